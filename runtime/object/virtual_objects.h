#pragma once

#include <optional>
#include <string>
#include <vector>

#include "runtime/object/object_surface.h"
#include "runtime/object/transfer.h"
#include "scene/config/config.h"
#include "scene/core/program.h"
#include "scene/core/result.h"
#include "scene/room/ray_scene.h"

namespace daylit {

/// Of a vertex whose material is looked up per pixel: its light is divided by it.
constexpr float kLeastReflectance = 0.02f;

/// All virtual objects of a scene, placed in the world.
struct VirtualObjects {
  /// One object in its own frame.
  struct Part {
    ObjectMesh mesh;
    std::vector<VertexTransfer> transfer;
    RayScene rays;
    std::size_t first_vertex = 0; ///< in surface
    glm::dmat4 world_from_object{1.0};
    glm::dvec3 centre_of_mass{0.0}; ///< of the mesh, in its own frame
    float opacity = 1.0f;           ///< what it keeps of light that comes from behind it; below 1: glass
    bool per_pixel = false;         ///< its material is looked up at every pixel (reflect/glossy_picture.h)
    std::vector<std::uint8_t> has_diffuse{}; ///< per vertex, of a part that is per_pixel
  };
  ObjectSurface surface;
  std::vector<VertexTransfer> transfer; ///< per vertex, world frame
  std::vector<std::uint8_t> has_back;   ///< per vertex: 0 where light from behind can reach nothing (closed meshes)
  std::vector<Part> parts;
  std::vector<std::string> notes; ///< one line per thing a user should know

  /// Places part k anew. Error value_invalid: there is no such part, or the scale is not positive and finite.
  Result<void> set_placement(std::size_t k, const ObjectConfig& placement);
  /// The first part that a ray meets within `most_m`; the direction is a unit vector, world.
  std::optional<std::size_t> first_hit(const glm::dvec3& eye, const glm::dvec3& direction, double most_m) const;
  /// Of part k in the world; radius 0 when there is none.
  BoundingSphere bounds(std::size_t k) const;
};

/// Reads, places and merges the objects; transfer vectors are cached in `cache_folder`.
Result<VirtualObjects> load_virtual_objects(const std::vector<ObjectConfig>& objects,
                                            const std::filesystem::path& cache_folder, const Progress& progress);

} // namespace daylit
