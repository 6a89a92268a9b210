#include "runtime/object/self_visibility.h"

#include <algorithm>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

namespace daylit {

SelfVisibility::SelfVisibility(const VertexRays& rays, std::size_t senders)
    : fans_(static_cast<std::size_t>(rays.rays()) / VertexRays::kFan), hidden_(2 * senders * fans_, 0) {
  const std::vector<glm::vec3> directions = rays.directions();
  for (int y = 0; y < kCells; ++y)
    for (int x = 0; x < kCells; ++x) {
      const glm::vec2 middle = (glm::vec2(x, y) + 0.5f) * (2.0f / kCells) - 1.0f;
      const auto nearest = std::ranges::min_element(
          directions, {}, [&](const glm::vec3& d) { return glm::distance(glm::vec2(d), middle); });
      nearest_.push_back(static_cast<std::uint16_t>(nearest - directions.begin()));
    }
}

void SelfVisibility::set(std::size_t sender, bool back, const SideView& view) {
  std::ranges::copy(view.hidden, hidden_.begin() + static_cast<std::ptrdiff_t>((2 * sender + back) * fans_));
}

} // namespace daylit
