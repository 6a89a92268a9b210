#include "precompute/detail/neighbours.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

#include <glm/common.hpp>

namespace daylit::precompute::detail {

namespace {

/// Splits along the longest side until every group is small: as many groups as are needed, half of them on each side.
void split(std::span<std::uint32_t> points, const std::vector<glm::vec3>& position, std::size_t most,
           std::vector<std::vector<std::uint32_t>>& groups) {
  if (points.size() <= most) {
    groups.emplace_back(points.begin(), points.end());
    return;
  }
  glm::vec3 low(position[points[0]]), high(low);
  for (const std::uint32_t p : points) {
    low = glm::min(low, position[p]);
    high = glm::max(high, position[p]);
  }
  const glm::vec3 size = high - low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    return position[a][axis] != position[b][axis] ? position[a][axis] < position[b][axis] : a < b;
  };
  std::ranges::sort(points, before);
  const std::size_t count = (points.size() + most - 1) / most, middle = points.size() * (count / 2) / count;
  split(points.first(middle), position, most, groups);
  split(points.subspan(middle), position, most, groups);
}

} // namespace

/// The parts one after another, each split.
std::vector<std::vector<std::uint32_t>> neighbours(const std::vector<glm::vec3>& position,
                                                   std::span<const std::uint32_t> part, std::size_t most) {
  std::vector<std::uint32_t> order(position.size());
  std::iota(order.begin(), order.end(), 0u);
  std::vector<std::vector<std::uint32_t>> groups;
  const auto part_of = [&](std::uint32_t p) { return part.empty() ? 0u : part[p]; };
  std::ranges::stable_sort(order, {}, part_of);
  for (auto first = order.begin(); first != order.end();) {
    const auto end = std::find_if(first, order.end(), [&](std::uint32_t p) { return part_of(p) != part_of(*first); });
    split(std::span(first, end), position, most, groups);
    first = end;
  }
  for (std::vector<std::uint32_t>& group : groups)
    std::ranges::sort(group);
  return groups;
}

} // namespace daylit::precompute::detail
