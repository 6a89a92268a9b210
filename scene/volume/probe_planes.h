#pragma once

// A grid of probes is rectilinear: its probes stand where planes across the three axes meet. The planes of a regular
// grid are equally far apart, those of a graded one closer together where the light changes fast. Every program takes
// the coordinates of a grid from here.

#include <array>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/core/result.h"

namespace daylit {

struct ProbeSet;

/// Counts multiply to the number of probes; spacing is positive; the coordinates of a graded grid are as many as its
/// counts, finite and increasing, and their mean distance is the spacing; probes are where the planes say (x fastest).
Result<void> check_grid(const ProbeSet& probes);

/// Where a point lies in a grid: lower corner of its cell, and how far into the cell, 0..1, clamped.
struct GridPosition {
  glm::ivec3 cell{0};
  glm::dvec3 fraction{0.0};
  bool clamped = false; ///< the point lies outside the outer probes
};

class ProbePlanes {
public:
  ProbePlanes() = default;
  /// Of a grid for which check_grid() holds. Regular and graded planes at the same coordinates give the same bits.
  explicit ProbePlanes(const ProbeSet& grid);

  /// Metres, relative to ProbeSet::origin.
  const std::vector<double>& along(int axis) const { return plane_[static_cast<std::size_t>(axis)]; }
  /// The last plane that is not beyond a world coordinate; -1: all are.
  int below(int axis, double world_m) const;
  GridPosition locate(const glm::dvec3& world_point) const;

private:
  glm::dvec3 origin_{0.0};
  std::array<std::vector<double>, 3> plane_;
};

} // namespace daylit
