#pragma once

#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "radiosity/detail/aimed_rays.h"
#include "radiosity/detail/plane_groups.h"

namespace daylit::radiosity {

/// How long facet edges may be in the duct that a small hole makes of a thick wall: all light of a dark room behind it
/// comes that way, and along it falls off within the width of the hole. Half that width, a quarter of the longest
/// extent of a slit. Holes in a wall: the end of a tube, the leg of a table, is none.
class NearHoles {
public:
  /// `holes`: of both ends of a duct, or of one; in the frame of `groups` and edge_m().
  NearHoles(std::span<const HoleOutline> holes, std::span<const PlaneGroup> groups);

  /// At a point of a surface of this normal; infinite outside ducts.
  double edge_m(const glm::dvec3& p, const glm::dvec3& normal) const;

private:
  struct Duct {
    HoleOutline outline;
    glm::dvec3 normal; ///< unit, along the duct
    double edge_m;
  };
  std::vector<Duct> holes_;
};

} // namespace daylit::radiosity
