#pragma once

// Light that the real room receives without the virtual objects: what the composite compares the lost light with.
//
// It changes slowly over a wall, and the wall does not move: it is kept at the corners of square cells of each plane
// of the room and interpolated. Which probes light a corner is found once; the values are renewed with the light. A
// cell that a surface cuts or that reaches out of the air is not used: its points are evaluated one by one.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include <glm/vec3.hpp>

#include "runtime/object/relight.h"
#include "runtime/sky/direct_light.h"
#include "scene/image/rgb_image.h"
#include "scene/room/ray_scene.h"
#include "scene/volume/volume.h"

namespace daylit {

/// Light at a point of the room without the objects, for the ratio and the difference.
struct RoomPoint {
  Rgb indirect_irradiance{0.0f};
  Rgb open_sky_irradiance{0.0f};   ///< unshadowed, through the apertures
  Rgb sun_normal_irradiance{0.0f}; ///< of the sun as it arrives through its pane
  Rgb reflectance{0.5f};
};

constexpr double kRoomLightCell_m = 0.08;

/// Keeps references to everything given; they must outlive it. at() is thread-safe.
class RoomLight {
public:
  RoomLight(const Room& room, const RayScene& room_rays, const LightFieldSampler& sampler);
  RoomLight(RoomLight&&) noexcept;
  RoomLight& operator=(RoomLight&&) noexcept;
  ~RoomLight();

  /// The light of one frame; what is given must live until the next. Equal versions mean that field and pyramid are as
  /// they were, so that what is kept holds where the cells are, too. 0: another sky.
  void set_frame(const LightField& field, std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells,
                 const LightSet& lights, std::uint64_t sky_version = 0);

  /// Light at the surface that a ray from the camera meets first; empty where it meets none.
  std::optional<RoomPoint> at(const glm::dvec3& eye, const glm::dvec3& direction) const;
  /// The same where it is known to meet a triangle, or one beside it in its plane.
  std::optional<RoomPoint> at_plane(std::uint32_t triangle, const glm::dvec3& eye, const glm::dvec3& direction) const;
  /// Light at world point x of a triangle of the room, on the side that `direction` meets.
  RoomPoint at_surface(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const;
  /// The same without cells: the slow twin.
  RoomPoint evaluate(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const;

  /// evaluate() of many points whose probes_at() are known, through these cells of the windows. Sixteen take little
  /// longer than one.
  struct KnownPoint {
    std::uint32_t triangle = 0;
    glm::dvec3 x{0.0}, n{0.0};
    VertexProbes probes;
  };
  void evaluate(std::span<const KnownPoint* const> points, std::span<const ApertureCell> windows,
                std::span<RoomPoint> light) const;

  /// The indirect part alone, for points that are looked up again: which probes light x, a point in the air, and what
  /// they give a surface of normal n.
  VertexProbes probes_at(const glm::dvec3& x) const;
  Rgb indirect_irradiance(const glm::dvec3& n, const VertexProbes& probes) const;

  /// Of the surface, towards the side that a ray along `direction` meets.
  const glm::dvec3& normal(std::uint32_t triangle, const glm::dvec3& direction) const;

  std::size_t cells_kept() const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace daylit
