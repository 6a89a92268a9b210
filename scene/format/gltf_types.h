#pragma once

// The library takes its default where a member of a material is of another type than the format says. Here that is an
// error.

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "scene/core/result.h"

namespace daylit::detail {

/// Error file_malformed: a number, a colour, a texture or an extension of a material is something else. Text that is no
/// JSON is left to the library.
std::optional<Error> check_material_types(std::span<const std::uint8_t> json, const std::string& name);

} // namespace daylit::detail
