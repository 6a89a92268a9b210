#pragma once

#include <array>
#include <cstddef>

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include "scene/room/room.h"

namespace daylit {

/// side^3 points inside a box, x first, and their trilinear weights. Outside the points the nearest of the lattice
/// hold.
class BoxLattice {
public:
  /// `inset`: of the box's size, that the outer points lie inside it: its faces may touch floors and walls.
  BoxLattice(const Bounds& box, int side, double inset)
      : min_(box.min), size_(glm::max(box.size(), glm::dvec3(1e-9))), side_(side), inset_(inset) {}

  std::size_t point_count() const { return static_cast<std::size_t>(side_) * side_ * side_; }
  glm::dvec3 position(std::size_t point) const {
    const auto side = static_cast<std::size_t>(side_);
    const glm::dvec3 step(point % side, point / side % side, point / (side * side));
    return min_ + (inset_ + (1.0 - 2.0 * inset_) / (side_ - 1) * step) * size_;
  }

  struct Corner {
    std::size_t point = 0;
    float weight = 0.0f;
  };
  /// The eight points around x; weights sum to 1.
  std::array<Corner, 8> around(const glm::dvec3& x) const {
    const glm::dvec3 p =
        glm::clamp(((x - min_) / size_ - inset_) / (1.0 - 2.0 * inset_), 0.0, 1.0) * static_cast<double>(side_ - 1);
    const glm::ivec3 low = glm::min(glm::ivec3(p), glm::ivec3(side_ - 2));
    const glm::dvec3 t = p - glm::dvec3(low);
    std::array<Corner, 8> corners;
    for (int k = 0; k < 8; ++k) {
      const glm::ivec3 at = low + glm::ivec3(k & 1, k >> 1 & 1, k >> 2);
      const double weight = (k & 1 ? t.x : 1 - t.x) * (k & 2 ? t.y : 1 - t.y) * (k & 4 ? t.z : 1 - t.z);
      corners[static_cast<std::size_t>(k)] = {static_cast<std::size_t>((at.z * side_ + at.y) * side_ + at.x),
                                              static_cast<float>(weight)};
    }
    return corners;
  }

private:
  glm::dvec3 min_, size_;
  int side_;
  double inset_;
};

} // namespace daylit
