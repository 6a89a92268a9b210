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

/// Of the solid where the mesh is closed, else of its sheets, as if everywhere as heavy; in the mesh's own frame.
glm::dvec3 centre_of_mass(const ObjectMesh& mesh);

/// A mesh and where its weight is.
struct WeighedMesh {
  const ObjectMesh& mesh;
  glm::dvec3 centre_of_mass{0.0}; ///< in the mesh's own frame

  explicit WeighedMesh(const ObjectMesh& m) : mesh(m), centre_of_mass(daylit::centre_of_mass(m)) {}
  WeighedMesh(const ObjectMesh& m, const glm::dvec3& centre) : mesh(m), centre_of_mass(centre) {}
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
