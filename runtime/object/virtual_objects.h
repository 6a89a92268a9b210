#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "runtime/object/object_surface.h"
#include "runtime/object/self_exchange.h"
#include "runtime/object/senders.h"
#include "runtime/object/transfer.h"
#include "scene/config/config.h"
#include "scene/core/program.h"
#include "scene/core/result.h"
#include "scene/placing/standing.h"
#include "scene/room/ray_scene.h"

namespace daylit {

/// Of a vertex whose material is looked up per pixel: its light is divided by it.
constexpr float kLeastReflectance = 0.02f;

/// All virtual objects of a scene, placed in the world.
struct VirtualObjects {
  /// What objects of one file and material share, in their own frame.
  struct Model {
    ObjectMesh mesh;
    std::vector<VertexTransfer> transfer;
    RayScene rays;
    MeshSenders senders{};
    SelfExchange self{}; ///< between the senders
  };
  /// One object.
  struct Part {
    std::shared_ptr<const Model> model;
    const ObjectMesh& mesh() const { return model->mesh; }
    const RayScene& rays() const { return model->rays; }
    std::size_t first_vertex = 0; ///< in surface
    /// Per vertex: which of Senders sends light for it; empty: each does itself, from number first_vertex on.
    std::vector<std::uint32_t> sender{};
    glm::dmat4 world_from_object{1.0};
    MeshWeight weight;                       ///< of the mesh
    bool per_pixel = false;                  ///< its material is looked up at every pixel (reflect/glossy_picture.h)
    std::vector<std::uint8_t> has_diffuse{}; ///< per vertex, of a part that is per_pixel
    BoundingSphere sphere{};                 ///< around its box, world
    bool is_metal = false;                   ///< some of it mirrors as metals do
    bool has_glass = false;
    Rgb transmittance{0.0f}; ///< of one with glass: mean part of light from behind it that comes through straight
    /// Some of it is drawn with the light at its vertices.
    bool shows_diffuse() const {
      return !per_pixel || std::ranges::any_of(has_diffuse, [](std::uint8_t some) { return some != 0; });
    }
    std::size_t sender_of(std::uint32_t v) const { return sender.empty() ? first_vertex + v : sender[v]; }
    glm::mat3 rotation() const; ///< of world_from_object, without its scale
  };
  /// The vertices that send light (senders.h), those of a part side by side.
  struct Senders {
    std::vector<std::uint32_t> vertex;    ///< of all objects, ascending
    ObjectSurface surface;                ///< with the emission of each; triangles between them
    std::vector<Rgb> diffuse_reflectance; ///< what they send on of the sun: the part of it that is diffuse
    /// What they mirror of other light, where they are of metal; empty where nothing is.
    std::vector<Rgb> mirrored_reflectance;
    std::vector<VertexTransfer> transfer; ///< of each, world frame
  };
  ObjectSurface surface; ///< without emission
  Senders senders;
  BoundingSphere sphere;              ///< ObjectSurface::bounds()
  std::vector<std::uint8_t> has_back; ///< per vertex: 0 where light from behind can reach nothing (closed meshes)
  std::vector<Part> parts;
  std::vector<std::string> notes; ///< one line per thing a user should know

  /// Places part k anew. Error value_invalid: there is no such part, or the scale is not positive and finite.
  Result<void> set_placement(std::size_t k, const ObjectConfig& placement);
  /// The first part that a ray meets within `most_m`; the direction is a unit vector, world.
  std::optional<std::size_t> first_hit(const glm::dvec3& eye, const glm::dvec3& direction, double most_m) const;
  /// Around the box of part k in the world; radius 0 when there is none.
  BoundingSphere bounds(std::size_t k) const { return k < parts.size() ? parts[k].sphere : BoundingSphere{}; }
  /// Of the vertex that sends light for vertex v of a part.
  const Rgb& sent_reflectance(const Part& part, std::uint32_t v) const {
    return part.sender.empty() ? surface.reflectance[part.first_vertex + v]
                               : senders.surface.reflectance[part.sender[v]];
  }
  /// Transfer vectors of some vertices of part k, numbered as in its mesh, world frame.
  std::vector<VertexTransfer> world_transfer(std::size_t k, std::span<const std::uint32_t> vertices) const;
  /// The spheres of all objects and of part k, after its positions in `surface` changed.
  void find_bounds(std::size_t k);
};

/// Reads, places and merges the objects; transfer vectors are cached in `cache_folder`.
Result<VirtualObjects> load_virtual_objects(const std::vector<ObjectConfig>& objects,
                                            const std::filesystem::path& cache_folder, const Progress& progress);

} // namespace daylit
