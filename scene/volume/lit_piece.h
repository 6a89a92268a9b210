#pragma once

// Mean light of a piece of a surface on which the edge of a sun patch may lie.

#include <array>
#include <cstdint>

#include <glm/geometric.hpp>

#include "scene/core/r2_points.h"
#include "scene/image/rgb_image.h"

namespace daylit {

constexpr int kPiecePoints = 64;    ///< of a piece,
constexpr int kFewPiecePoints = 32; ///< of them where all are lit or none is: what none of these meets is left out

/// Mean of `light(point, k)`, k below kPiecePoints. Pieces side by side have different points.
template <class Light>
Rgb mean_over_piece(const std::array<glm::dvec3, 3>& piece, const Light& light) {
  const double turn = glm::dot(piece[0], glm::dvec3(7919.13, 10472.97, 15485.63));
  Rgb sum(0.0f);
  int lit = 0, count = 0;
  for (; count < kPiecePoints && (count != kFewPiecePoints || (lit > 0 && lit < count)); ++count) {
    const Rgb at = light(on_triangle(piece, r2_point(static_cast<std::uint32_t>(count), {turn, 0.37 * turn})), count);
    sum += at;
    lit += at != Rgb(0.0f);
  }
  return sum / static_cast<float>(count);
}

} // namespace daylit
