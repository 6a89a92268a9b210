#pragma once

// Where facets may be larger: on surfaces whose light hardly reaches the points at which it is wanted
// (importance-driven refinement: Smits, Arvo, Salesin 1992).

#include <cstddef>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/room/ray_scene.h"
#include "scene/room/room.h"

namespace daylit::radiosity {

/// A facet's error counts by its importance W (what a unit of light sent out there brings to the receivers) and its
/// size h as W h^4; the same error for every facet asks for h ~ W^(-1/4). Surfaces with more than a tenth of the usual
/// importance keep their size.
class SizeField {
public:
  static constexpr double kCoarsest = 6.0;

  /// One everywhere.
  SizeField() = default;
  /// W by diffuse walks from the receivers, which are in the room's coordinates; none: one everywhere. `rays`: the
  /// room's reflecting surfaces. A function of the input alone.
  SizeField(const Room& room, const RayScene& rays, std::span<const glm::dvec3> receivers);

  /// 1 to kCoarsest: what an edge at p (the room's coordinates) may be longer.
  double at(const glm::dvec3& p) const;
  /// W there: 1 and more where facets keep their size, 0 where no walk came.
  double importance(const glm::dvec3& p) const;

private:
  std::size_t cell_of(const glm::dvec3& p) const;

  std::vector<double> importance_; ///< of each cell, 0 where no walk came; empty: one everywhere
  glm::dvec3 low_{0.0};
  glm::ivec3 cells_{0};
  double cell_m_ = 1;
};

} // namespace daylit::radiosity
