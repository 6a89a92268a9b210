#pragma once

#include <optional>
#include <vector>

#include <glm/vec3.hpp>

namespace daylit::detail {

/// A planar outline with holes as one outline that runs to each hole and back along a bridge (Held 2001, section 3).
/// Empty: a hole crosses the outline or another hole, or no bridge was found.
std::optional<std::vector<glm::dvec3>> bridged_outline(const std::vector<glm::dvec3>& outline,
                                                       std::vector<std::vector<glm::dvec3>> holes);

} // namespace daylit::detail
