#pragma once

// What a ray that leaves a virtual object sees of the real room: the photograph where the camera sees that point, else
// the room's computed light, else sky and sun through the window it passes.

#include <optional>
#include <span>

#include "runtime/base/photo_scale.h"
#include "runtime/base/render_camera.h"
#include "runtime/composite/compose.h"
#include "runtime/depth/real_things.h"
#include "runtime/indirect/indirect_shadow.h"
#include "runtime/indirect/room_light.h"
#include "runtime/object/object_rays.h"
#include "runtime/sky/sky_map.h"
#include "scene/lens/lens.h"
#include "scene/room/aperture.h"
#include "scene/sky/sun.h"

namespace daylit {

/// What is left of the room's light, channel by channel: the picture over the photograph, 0 to 1.
Rgb left_of(const Rgb& picture, const Rgb& photo);

/// The photograph with the objects' shadows on the room, as a map of the room's radiance.
class PhotographedRoom {
public:
  /// Keeps references to all. `white`: from which value on a pixel of the photograph says nothing but that it is
  /// bright. `photo`: without the objects; null: behind them nothing is seen.
  PhotographedRoom(const Composite& composite, const RenderCamera& camera, const LensModel& lens,
                   const PhotoScale& scale, float white, const PhotoPixels* photo = nullptr);

  /// Radiance of world point x, bilinear. Empty where it lies outside the picture, behind an object in it, or where the
  /// picture is white. What of the room stands before x is not looked at.
  std::optional<Rgb> radiance(const glm::dvec3& x) const;
  struct Seen {
    Rgb radiance{0.0f};
    bool is_covered = false; ///< by an object: it is as without the objects
  };
  /// The same behind objects too.
  std::optional<Seen> look(const glm::dvec3& x) const;
  /// The same of the nearest pixel alone: at the edge of a thing that stands before an object.
  std::optional<Rgb> nearest(const glm::dvec3& x) const;
  /// Part of the photograph's light that the objects leave at x; 1 where an object or nothing is seen.
  Rgb left_at(const glm::dvec3& x) const;
  glm::dvec3 eye() const { return camera_.eye(); }

private:
  std::optional<glm::dvec2> pixel_of(const glm::dvec3& x) const;
  bool is_known(std::size_t pixel) const;
  /// Bilinear between four pixels around a place; empty where one has no value.
  template <class Value>
  std::optional<Rgb> between_pixels(const glm::dvec2& place, const Value& value) const;
  std::optional<Rgb> drawn_at(const glm::dvec2& place) const;
  Rgb from_photo(const Rgb& value) const;

  const Composite& composite_;
  const RenderCamera& camera_;
  const LensModel& lens_;
  glm::dmat3 camera_from_world_{1.0}, radiance_from_photo_{1.0};
  double scale_x_ = 1.0, scale_y_ = 1.0; ///< of the photograph over the lens's calibration
  float white_ = 1.0f;
  const PhotoPixels* photo_ = nullptr;
};

/// Where a ray ends in the room.
struct RoomEnd {
  std::uint32_t triangle = 0; ///< kUnknownTriangle: a thing that the room's model lacks
  double distance = 0.0;
};

/// A ray from outside the objects, with what it finds in the room.
struct RoomRay {
  WorldRay ray;
  double most_m = 1e9;        ///< its end is looked for up to here
  float width_rad = 0.0f;     ///< of the part of a lobe that it stands for; 0: sharp, the sun's disc is seen too
  std::optional<RoomEnd> end; ///< empty: nowhere, it leaves
  Rgb radiance{0.0f};         ///< that arrives against the ray
  bool past_objects = false;  ///< the last of a sample: where the model says its radiance, without the objects
  bool without_gloss = false; ///< what a declared surface mirrors is left out: another ray finds it
};

/// On from a surface that is declared to mirror.
struct MirroredRay {
  WorldRay ray;
  float share = 0.0f; ///< of the light along it
};

/// Keeps references to all that it is made of. Thread-safe. Rays come in batches of at most kRayBatch.
struct RoomSeen {
  const Room& room;
  const RayScene& rays;
  const RoomLight& light;
  const IndirectShadow* shadow = nullptr; ///< what the objects do to the room; null: not known
  std::span<const SkyMap> pyramid;        ///< of the sky without the sun
  const std::optional<DetectedSun>& sun;
  const ApertureCrossings& windows;
  const ObjectRays& objects;
  const PhotographedRoom* photograph = nullptr; ///< null: only computed light
  const RealThings* things = nullptr;           ///< seen in the photograph, where it is given; null: none
  std::span<const float> gloss = {};            ///< of each triangle: declared_gloss(); empty: nothing mirrors

  /// Fills in where they end.
  void find_ends(std::span<RoomRay> batch) const;
  /// Fills in the radiance from there; of the sky where a ray leaves.
  void find_radiance(std::span<RoomRay> batch) const;
  /// What a declared surface at the end of a ray mirrors.
  std::optional<MirroredRay> mirrored(const WorldRay& ray, const RoomEnd& end) const;
  /// Irradiance of the sun at x on a plane facing it, past the room and through the objects; zero without one.
  Rgb sun_at(const glm::dvec3& x) const;
  /// The same of four points of the disc, turned by a part of a quarter turn.
  Rgb disc_at(const glm::dvec3& x, double turn) const;
  /// Radiance of the sky without its sun, before panes; of a part of it as wide as RoomRay::width_rad.
  Rgb sky(const glm::vec3& direction, float width_rad) const;
  /// Part of the light from far away in a direction that arrives at x through a window, past the room and the objects.
  Rgb arrives_from(const glm::dvec3& x, const glm::dvec3& direction) const;
  /// The same with no object in the way, not even glass.
  Rgb arrives_freely_from(const glm::dvec3& x, const glm::dvec3& direction) const;

private:
  void find_things(RoomRay& ray) const;
  std::optional<Rgb> thing_radiance(const RoomRay& ray, double distance) const;
  Rgb outside(const RoomRay& ray) const;
  Rgb passes_room(const glm::dvec3& x, const glm::dvec3& direction) const;
  std::optional<PhotographedRoom::Seen> photographed_at(const RoomRay& ray, const glm::dvec3& x) const;
  std::uint32_t hidden_from_camera(std::span<const RoomRay> batch, std::span<const glm::dvec3> x,
                                   std::uint32_t asked) const;
  RoomIrradiance irradiance(const RoomRay& ray, const glm::dvec3& x) const;
  void take_out_gloss(std::span<RoomRay> batch, std::span<const glm::dvec3> x, std::uint32_t photographed,
                      std::uint32_t covered) const;
  Rgb computed(const RoomRay& ray, const glm::dvec3& x) const;
  Rgb change(const RoomRay& ray, const glm::dvec3& x) const;
};

} // namespace daylit
