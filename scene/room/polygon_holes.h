#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace daylit::detail {

/// A planar outline with holes as one outline that runs to each hole and back along a bridge (Held 2001, section 3).
/// Empty: a hole crosses the outline or another hole, or no bridge was found.
std::optional<std::vector<glm::dvec3>> bridged_outline(const std::vector<glm::dvec3>& outline,
                                                       std::vector<std::vector<glm::dvec3>> holes);

/// The order of the corners of an outline in which its holes run against it: a hole is joined to it by a seam, an edge
/// there and back. Radiance leaves such a hole open whichever way it is wound (Reference Manual, "polygon").
std::vector<std::uint32_t> order_against_holes(std::span<const glm::dvec2> corners);

} // namespace daylit::detail
