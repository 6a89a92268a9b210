#pragma once

// Where objects stand: level faces with air above. Close above them the light changes within centimetres, and people
// look there; probes and points of the audit are placed by them.

#include <array>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/room/room.h"

namespace daylit::precompute {

/// Level faces of one height that touch each other.
struct StandingFace {
  std::vector<RoomTriangle> triangles;
  Bounds box; ///< world metres
  double area_m2 = 0;
};

/// Faces of at least 0.05 m^2 with 10 cm of free height, largest first. `material` not empty: those of that material
/// alone. Errors: value_invalid, no such face of the material; those of RayScene.
Result<std::vector<StandingFace>> standing_faces(const Room& room, const std::string& material = "");

/// A plane of probes across an axis.
struct ProbePlane {
  double at = 0;                   ///< along the axis, world metres
  std::vector<Bounds> where;       ///< the plane's probes are wanted in one of these boxes; empty: everywhere
  std::vector<Bounds> beside = {}; ///< or in one of these, which change nothing about other planes
  bool added = false;              ///< for these alone
};
/// Per axis, increasing.
using Planes = std::array<std::vector<ProbePlane>, 3>;

/// Adds a plane along one axis, or what it is wanted for to one that is there already within the tolerance. Nothing
/// where there are 48: the caller brings the most wanted first, and sorts them when all are there.
void add_plane(std::vector<ProbePlane>& planes, double at, double tolerance_m, const Bounds& where);

/// Planes of probes close above those faces and just inside the edges of those that are rectangles along the axes.
/// Few: one plane serves all faces that ask for about the same one, and is wanted above these.
Planes planes_near(const std::vector<StandingFace>& faces, const Bounds& room);

/// Adds planes before the sides of what ends in such a rectangle, and there below its top: beside its edge a point at
/// the height of the top sees what probes above it and at its foot do not.
void add_planes_beside(const std::vector<StandingFace>& faces, const Bounds& room, Planes& planes);

/// Points 1 to 30 cm above the faces (R3 sequence over area and the logarithm of height, Roberts 2018), world metres:
/// those of `count` that are at least 9 mm from everything. Errors of RayScene.
Result<std::vector<glm::dvec3>> points_above(const Room& room, const std::vector<StandingFace>& faces,
                                             std::size_t count);

} // namespace daylit::precompute
