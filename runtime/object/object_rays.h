#pragma once

// The virtual objects as reflected rays meet them. Rays are turned into the frame of each object: nothing is built when
// one moves, and copies of an object share its triangles.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>

#include "runtime/object/virtual_objects.h"

namespace daylit {

/// World metres; unit direction.
struct WorldRay {
  glm::dvec3 origin{0.0};
  glm::vec3 direction{0.0f};
};

/// Rays are followed in batches of as many.
constexpr std::size_t kRayBatch = 16;

/// First point of the objects along a ray.
struct ObjectPoint {
  std::size_t part = 0;
  std::uint32_t triangle = 0;  ///< of the part's mesh
  float u = 0.0f, v = 0.0f;    ///< weights of corners 1 and 2
  double distance = 0.0;       ///< metres
  glm::dvec3 position{0.0};    ///< world
  glm::vec3 face_normal{0.0f}; ///< unit, world, outside of the mesh
};

/// Keeps a reference to the objects; they must not move while it is used. Thread-safe.
class ObjectRays {
public:
  explicit ObjectRays(const VirtualObjects& objects);

  std::optional<ObjectPoint> closest(const WorldRay& ray, double most_m) const;
  /// Of at most kRayBatch rays at once, each with its own limit.
  void closest(std::span<const WorldRay> rays, std::span<const double> most_m,
               std::span<std::optional<ObjectPoint>> points) const;
  /// What of light comes through the objects on the way, straight: 0 past an opaque one; of glass, what its faces do
  /// not mirror and its inside does not absorb.
  Rgb transmittance(const WorldRay& ray, double most_m) const;
  /// Mean of transmittance() over the rays that meet the part, from all sides, as if it stood alone.
  Rgb mean_transmittance(std::size_t part) const;
  /// How far from a surface of the part rays start, metres.
  double offset_m(std::size_t part) const { return placed_[part].offset_m; }
  /// Directions of the part's frame in the world, unit lengths kept.
  const glm::mat3& rotation(std::size_t part) const { return placed_[part].rotation; }
  double scale(std::size_t part) const { return placed_[part].scale; }
  const VirtualObjects& objects() const { return objects_; }

private:
  struct Placed {
    glm::dmat4 own_from_world{1.0};
    glm::mat3 rotation{1.0f};
    double scale = 1.0, offset_m = 0.0;
    BoundingSphere sphere; ///< world
  };
  /// Of placed_.
  struct Parts {
    std::size_t first = 0, last = 0;
  };
  Parts all() const { return {0, placed_.size()}; }
  std::optional<ObjectPoint> closest(const WorldRay& ray, double most_m, Parts parts) const;
  Rgb transmittance(const WorldRay& ray, double most_m, Parts parts) const;
  void complete(const WorldRay& ray, ObjectPoint& point) const;
  bool may_meet(const Placed& part, const WorldRay& ray, double most_m) const;
  const VirtualObjects& objects_;
  std::vector<Placed> placed_;
};

} // namespace daylit
