#pragma once

// The objects' faces of glass, as light goes straight through them.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "runtime/object/object_surface.h"
#include "runtime/shading/point_block.h"
#include "runtime/trace/packet_scene.h"

namespace daylit {

class GlassFaces {
public:
  /// `positions`: of the objects' vertices, metres relative to the renderer's origin. Error: out of memory.
  static Result<GlassFaces> build(const ObjectSurface& objects, std::span<const glm::vec3> positions);
  /// Which of the objects' triangles are of glass.
  static std::vector<std::uint8_t> mark(const ObjectSurface& objects);

  bool is_of(const std::vector<GlassObject>& objects) const { return objects == objects_; }
  /// The same objects after the vertices moved; as a whole where `rigid` says so (PacketScene::set_transform()).
  Result<void> move(const ObjectSurface& objects, std::span<const glm::vec3> positions, const Similarity* rigid);

  /// Lanes whose ray meets glass; of these `left`: the part of light that comes through, past glass alone. Directions
  /// must be unit vectors.
  LaneMask pass(LaneMask lanes, const RayPacket16& rays, LaneRgb& left) const;
  /// The same lanes, without what is left.
  LaneMask meets(LaneMask lanes, const RayPacket16& rays) const { return rays_.occluded(lanes, rays); }

private:
  class Passing;
  struct Face {
    const ObjectMesh* mesh = nullptr;
    std::uint32_t own_triangle = 0; ///< of the mesh
    std::uint32_t triangle = 0;     ///< of all objects
    glm::vec3 normal{0.0f};         ///< unit, outside
    bool has_even_colour = true;
    Rgb colour{0.0f}, absorption_per_m{0.0f};
    float ior = 1.0f;
  };
  static Face face_of(const ObjectMesh& mesh, std::uint32_t own_triangle, std::uint32_t triangle);
  void find_normals(const ObjectSurface& objects, std::span<const glm::vec3> positions);

  std::vector<GlassObject> objects_; ///< their meshes are kept for the faces
  std::vector<Face> faces_;          ///< in the order of the ray scene
  PacketScene rays_;
};

} // namespace daylit
