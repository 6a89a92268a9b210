#pragma once

#include <filesystem>

#include "scene/core/result.h"
#include "scene/volume/volume.h"

namespace daylit {

/// A volume keeps the hash of its room. The model is read with either axis up: a CONFIG.toml does not say which. Error:
/// the model cannot be read, or the volume was baked from another one. An empty path, or a volume without a hash, is
/// no error.
Result<void> check_room_model(const std::filesystem::path& model, const VolumeProvenance& volume);

} // namespace daylit
