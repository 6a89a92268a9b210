#pragma once

#include <filesystem>

#include "scene/config/config.h"
#include "scene/core/result.h"

namespace daylit {

/// The [marker] section of a CONFIG.toml, whatever else is in it. Error: missing, not TOML, no such section, and
/// problems of the section.
Result<MarkerConfig> read_marker_config(const std::filesystem::path& path);

} // namespace daylit
