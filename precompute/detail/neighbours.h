#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

namespace daylit::precompute::detail {

/// Groups of points that lie beside each other, as few of about one size as hold at most `most` each, and each of one
/// `part` (an id for each point; empty: all the same). Within a group ids rise.
std::vector<std::vector<std::uint32_t>> neighbours(const std::vector<glm::vec3>& position,
                                                   std::span<const std::uint32_t> part, std::size_t most);

} // namespace daylit::precompute::detail
