#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "scene/core/result.h"

namespace daylit::detail {

/// Error file_malformed: the name's extension is that of a format of models that no reader here knows. `known`: those
/// that the caller reads, for the hint.
std::optional<Error> refuse_foreign_model(const std::filesystem::path& path, const std::string& known);

} // namespace daylit::detail
