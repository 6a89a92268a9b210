#pragma once

// What the vertices of a mesh see of the mesh itself.

#include <array>
#include <cstdint>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "scene/model/object_mesh.h"
#include "scene/room/ray_scene.h"

namespace daylit {

/// Where a blocked ray ends: a side of a triangle, and the weights of its corners 1 and 2 in 65535ths.
struct SeenPoint {
  std::uint32_t triangle : 31;
  std::uint32_t on_back : 1;
  std::uint16_t u, v;
};

/// One side of the surface at a vertex.
struct SideView {
  std::array<float, 9> blocked{};    ///< integral over the blocked directions of cos Y_lm
  std::vector<SeenPoint> seen;       ///< one for each blocked ray
  std::vector<std::uint16_t> hidden; ///< which these are: a bit for each ray of a fan
};

/// Keeps references to mesh and scene. Safe to use from several threads.
class VertexRays {
public:
  static constexpr int kFan = 16;
  /// `scene`: of the mesh, in its own frame. `rays`: cast from each side of a vertex with a density of cos / pi, in
  /// fans of sixteen; others are rounded up.
  VertexRays(const ObjectMesh& mesh, const RayScene& scene, int rays);

  /// Looks from a vertex into the hemisphere around `normal`, which is the vertex's own or its opposite.
  SideView look(std::uint32_t vertex, const glm::vec3& normal) const;
  /// Of that side: its rays stand about +z of this frame; columns are world axes of a mesh that is not turned.
  static glm::mat3 frame(const glm::vec3& normal);
  /// All rays, fan after fan, in frame().
  std::vector<glm::vec3> directions() const;
  int rays() const { return static_cast<int>(fans_.size()) * kFan; }

private:
  /// Sixteen neighbouring directions around +z, and cos Y_lm / pdf of each.
  struct alignas(64) Fan {
    float x[kFan], y[kFan], z[kFan];
    float harmonics[9][kFan];
  };
  enum class Hit { none, front, back };
  void find_faces();
  void find_starts();
  Hit classify(std::uint32_t vertex, const glm::vec3& normal, const glm::vec3& w, std::uint32_t triangle) const;
  bool dips_below(std::uint32_t vertex, const glm::vec3& normal, const glm::vec3& w) const;

  SeenPoint seen_point(const glm::vec3& origin, const glm::vec3& w, std::uint32_t triangle, bool on_back) const;

  const ObjectMesh* mesh_;
  const RayScene* scene_;
  std::vector<Fan> fans_;
  std::vector<glm::vec3> face_normal_; ///< unit, zero where a face has no area
  /// Faces around the position of each vertex: vertices at one position (at seams) have the same faces.
  std::vector<std::uint32_t> group_, first_face_, face_;
  std::vector<glm::vec3> inwards_; ///< of each vertex: where rays start beside it, in surface offsets
};

} // namespace daylit
