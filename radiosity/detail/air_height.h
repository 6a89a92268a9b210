#pragma once

#include <glm/vec3.hpp>

#include "radiosity/size_field.h"
#include "scene/core/result.h"
#include "scene/room/ray_scene.h"
#include "scene/room/room.h"

namespace daylit::radiosity {

/// How long facet edges may be where the air is low: as long as it is high, or a quarter of the longest where that is
/// more. Between the boards of a shelf, on a floor below a bench, light falls off within that height.
class AirHeight {
public:
  /// `field`: a side of a surface that none of its walks comes to does not count, kept by reference. `least_m`: air
  /// that is lower than that does not count.
  static Result<AirHeight> make(const Room& room, const SizeField& field, double least_m);

  /// At a point of a surface, the room's coordinates, where edges are `longest_m` at most.
  double edge_m(const glm::dvec3& p, const glm::dvec3& normal, double longest_m) const;

private:
  AirHeight(RayScene rays, const SizeField& field, double least_m)
      : rays_(std::move(rays)), field_(&field), least_m_(least_m) {}
  double height_m(const glm::dvec3& p, double within_m) const;

  RayScene rays_;
  const SizeField* field_;
  double least_m_;
};

} // namespace daylit::radiosity
