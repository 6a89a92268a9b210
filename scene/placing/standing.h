#pragma once

// Can an object stand where it is? It tips when its centre of mass is not above what it stands on; it cannot be there
// when surfaces of the room cut through it.

#include <optional>
#include <string>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "scene/model/object_mesh.h"
#include "scene/room/ray_scene.h"
#include "scene/room/room.h"

namespace daylit {

struct MeshWeight {
  glm::dvec3 centre_of_mass{0.0}; ///< in the mesh's own frame
  bool closed = false;            ///< every edge has as many triangles on one side as on the other
};
/// Of the solid where the mesh is closed, else of its sheets, as if everywhere as heavy.
MeshWeight weigh(const ObjectMesh& mesh);

/// A mesh and its weight.
struct WeighedMesh {
  const ObjectMesh& mesh;
  MeshWeight weight;

  explicit WeighedMesh(const ObjectMesh& m) : mesh(m), weight(weigh(m)) {}
  WeighedMesh(const ObjectMesh& m, const MeshWeight& known) : mesh(m), weight(known) {}
};

/// World box of a placed mesh.
Bounds placed_bounds(const ObjectMesh& mesh, const glm::dmat4& world_from_object);

struct Standing {
  double beyond_m =
      0.0; ///< the centre of mass from the support polygon of the contact points, horizontally; 0: above it
  bool supported = true;         ///< something is under some of its lowest points
  std::optional<glm::dvec3> cut; ///< a world point where the room cuts through it
  std::string cut_by;            ///< material there
  bool tips(double size_m) const { return !supported || beyond_m > 0.01 * size_m; }
};

/// Lowest points within 1 mm, or 0.2 % of the height, are the contact points where the room is right below them.
Standing check_standing(const WeighedMesh& object, const glm::dmat4& world_from_object, const Room& room,
                        const RayScene& rays);

/// What a user is told, a line each: nothing where it stands well.
std::vector<std::string> standing_warnings(const std::string& name, const Standing& standing, double size_m);

} // namespace daylit
