#pragma once

// The virtual objects as rays meet them where they stand: each keeps the ray scene of its own frame, and rays are
// turned instead of triangles. Nothing is rebuilt when an object moves.

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>

#include "runtime/sky/window_cone.h"
#include "scene/model/object_mesh.h"
#include "scene/room/ray_scene.h"

namespace daylit {

/// One rigid object. `rays`: its triangles in its own frame, numbered from 0.
struct PlacedPart {
  const RayScene* rays = nullptr;
  std::span<const std::array<std::uint32_t, 3>> triangles; ///< of `rays`, vertices of the part
  std::span<const glm::vec3> positions;                    ///< own frame
  std::size_t first_vertex = 0;                            ///< in the light of all objects, without `sender`
  glm::dmat4 world_from_object{1.0};                       ///< rigid but for one scale
  const ObjectMesh* glass = nullptr; ///< its mesh, where faces of it are of glass; null: light stops at it
  Rgb transmittance{0.0f}; ///< of one with glass: mean part of light from behind it that comes through straight
  /// Per vertex, where given: its place in the light of all objects, counted in the order of the vertices.
  std::span<const std::uint32_t> sender{};
  std::span<const glm::vec3> mirror_normals{}; ///< of the vertices, own frame; empty where nothing mirrors
};

/// First point of an object along a ray.
struct PartHit {
  std::array<std::uint32_t, 3> vertex{}; ///< of all objects
  float u = 0.0f, v = 0.0f;              ///< weights of corners 1 and 2
  bool back = false;
  double distance = 0.0;    ///< metres
  glm::vec3 mirrored{0.0f}; ///< where light that is mirrored against the ray comes from, world; 0 where nothing mirrors
};

class PlacedParts {
public:
  PlacedParts() = default;
  /// What the parts refer to must outlive this.
  explicit PlacedParts(std::vector<PlacedPart> parts);

  std::size_t size() const { return casters_.size(); }
  const PlacedPart& part(std::size_t which) const { return casters_[which].part; }
  const BoundingSphere& sphere(std::size_t which) const { return casters_[which].sphere; } ///< world; radius 0: empty
  double smallest_radius() const { return smallest_radius_; } ///< of a sphere, at least a millimetre; 1 without parts
  const Bounds& box(std::size_t which) const { return casters_[which].box; } ///< own frame
  std::span<const glm::vec3> positions(std::size_t which) const {
    return casters_[which].part.positions;
  } ///< own frame
  /// Vertices of a part that send light, ascending.
  std::vector<std::uint32_t> senders(std::size_t which) const;
  /// The part of light from behind it that a part keeps.
  float opacity(std::size_t which) const { return 1.0f - luminance(casters_[which].part.transmittance); }
  glm::dvec3 to_world(std::size_t which, const glm::dvec3& own) const;
  glm::dvec3 to_own(std::size_t which, const glm::dvec3& world) const;

  /// Up to sixteen rays from x; `directions`: unit, world. Bit k of the result: ray k meets part `which`, and no other
  /// part but `ignored` before it; hits[k].
  std::uint32_t cast_first(std::size_t which, const glm::dvec3& x, std::span<const glm::dvec3> directions,
                           std::span<PartHit> hits, std::size_t ignored) const;
  /// The front of a part other than `ignored` lies in the direction, nearer than that: x is not inside it.
  bool hidden(const glm::dvec3& x, const glm::dvec3& direction, double distance_m, std::size_t ignored) const;
  /// To the nearest surface of a part, metres; `within_m` where none is nearer.
  double distance(const glm::dvec3& x, double within_m) const;
  double distance(std::size_t which, const glm::dvec3& x, double within_m) const; ///< of that part
  /// A surface of a part stands between two points.
  bool between(const glm::dvec3& a, const glm::dvec3& b) const;
  /// What of light from the direction comes through all parts, by the mean of those with glass; 0 behind others.
  Rgb passed(const glm::dvec3& x, const glm::dvec3& direction) const;
  /// The same of one part with glass, face by face. A face that x lies on counts.
  Rgb passed_straight(std::size_t which, const glm::dvec3& x, const glm::dvec3& direction) const;
  /// Up to sixteen directions: bit k is set where a part without glass lies in direction k. A part may be left out.
  static constexpr std::size_t kNone = ~std::size_t{0};
  std::uint32_t occluded(const glm::dvec3& x, std::span<const glm::dvec3> directions,
                         std::size_t ignored = kNone) const;
  /// The same of one part alone, with glass or without; only directions whose bit is set in `asked`.
  std::uint32_t covered(std::size_t which, const glm::dvec3& x, std::span<const glm::dvec3> directions,
                        std::uint32_t asked) const;

private:
  struct Caster {
    PlacedPart part;
    glm::dmat3 own_from_world{1.0}; ///< rotation only
    glm::dvec3 position{0.0};
    double scale = 1.0;
    Bounds box;
    BoundingSphere sphere;
  };
  static bool may_cover(const Caster& caster, const glm::dvec3& x, const glm::dvec3& direction);
  bool cast(std::size_t which, const glm::dvec3& x, const glm::dvec3& direction, PartHit& hit) const;
  PartHit part_hit(const Caster& caster, const glm::vec3& own_direction, const RayHit& found) const;
  std::vector<Caster> casters_;
  double smallest_radius_ = 1.0;
};

} // namespace daylit
