#pragma once

// Radiance along a ray among virtual objects that mirror and refract: all rays of a level of the tree together, of each
// surface the brightest branch and those that can be seen beside it (Whitted 1980; rough surfaces by samples of their
// lobe, Walter et al. 2007).

#include <optional>
#include <span>

#include <glm/mat2x2.hpp>

#include "runtime/object/object_rays.h"
#include "runtime/object/relight.h"
#include "runtime/reflect/room_seen.h"
#include "runtime/sky/direct_light.h"
#include "scene/material/bsdf.h"
#include "scene/model/surface_look.h"

namespace daylit {

class ObjectMaps;
struct Surroundings;

struct GlossySettings {
  /// Rays one after the other, after the camera's; the last one meets the room alone. Up to 48 total reflections on
  /// the way do not count: a wall of glass leads light far.
  int most_depth = 8;
  /// More of them where metal sends all light on one way, and a tenth of the sample's: the inside of a cup.
  int most_more = 4;
  /// Of its light to the camera: a branch that brings less, and is not the brightest of its surface, is not followed;
  /// it is as bright as the room's light on the surface.
  float least_importance = 0.02f;
  float least_inside = 0.035f; ///< the same inside of an object, from the third surface on
  float least_first = 0.004f;  ///< the same of what the camera sees itself: a window is far brighter than the room
  /// Surroundings of objects: where there are some, a look-up for each lobe stands for the rays of the camera's points.
  const ObjectMaps* maps = nullptr;
};

/// A point of an object that a ray of the camera meets.
struct CameraPoint {
  WorldRay ray;
  ObjectPoint point;
  std::span<const glm::vec2> places; ///< of the unit square, where in the lobe rays go; one is taken of a narrow lobe
  double width_m = 0.0;              ///< of the pixel on the surface
  int lights = 0;                    ///< which sixteenth of the sky's lights it looks at, 0 to 15
};

/// What a sample of a pixel shows of an object whose material is looked up.
struct GlossyLight {
  Rgb diffuse{1.0f};  ///< reflectance of the diffuse part: times irradiance / pi is its radiance
  Rgb radiance{0.0f}; ///< mirrored and refracted
  Rgb albedo{1.0f};   ///< of a wide lobe, that part of light from everywhere
  Rgb coat{0.0f};     ///< mirrored by a narrow coat above a wide lobe
  Rgb glint{0.0f};    ///< the sun's highlight, and what the surface sends by itself: no neighbour shares them
  /// Of the diffuse part's radiance: indirect light that an occlusion texture takes away; below 0 where a normal map
  /// adds more of it than `diffuse` says.
  Rgb occluded{0.0f};
  glm::vec3 normal{0.0f}; ///< of the shading, world
  float alpha = 0.0f;     ///< slope of the narrowest lobe; 0 where none is followed
  bool opaque = true;     ///< nothing goes through
  int met = 0;            ///< rays of a wide lobe that met an object
};

/// From this slope on a lobe takes several rays, which neighbouring pixels share. Below, it shows sharp pictures.
constexpr float kWideAlpha = 0.01f;

/// Keeps references to what it is made of. Thread-safe.
class GlossyRays {
public:
  /// `sent`: radiance of each vertex of all objects as a diffuse surface, on both sides; `indirect`: what of it is not
  /// straight from sky and sun. `sky`: the frame's samples of the sky, by which wide lobes find it beside their own
  /// samples; none: by these alone. `arriving`: the room's light at each vertex that sends light, for normal maps;
  /// none: these do not shade it.
  GlossyRays(const RoomSeen& room, std::span<const TwoSided> sent, std::span<const TwoSided> indirect,
             std::span<const DirectionalLight> sky, const GlossySettings& settings,
             std::span<const Sh9Rgb> arriving = {});

  /// What the camera sees of up to kRayBatch points. Returns how many rays were traced.
  std::uint64_t look(std::span<const CameraPoint> points, std::span<GlossyLight> lights) const;
  /// Along rays from outside the objects: what they meet first, of them or of the room. `width_rad`:
  /// RoomRay::width_rad.
  void radiance(std::span<const WorldRay> rays, std::span<Rgb> radiances, float width_rad = 0.0f) const;
  const ObjectMaterial* material(const ObjectPoint& point) const;

private:
  struct Surface;
  struct Branch;
  struct Work;
  Surface surface(const WorldRay& ray, const ObjectPoint& point, double width_m, int channel) const;
  void follow(Work& work) const;
  void step(std::span<const Branch> batch, Work& work) const;
  bool mirror_in_room(const Branch& branch, const RoomRay& met, Work& work) const;
  Rgb one_light(const ObjectPoint& point, const Surface& s, Branch& onward, const glm::vec2& u) const;
  void arrive(const Branch& branch, const ObjectPoint& point, Work& work) const;
  void spread(const ObjectPoint& point, const Surface& s, const Branch& from, const glm::vec2& place, Work& work) const;
  Rgb spread_several(const ObjectPoint& point, const Surface& s, Branch onward, Work& work) const;
  WorldRay onward(const ObjectPoint& point, const Surface& s, const glm::vec3& direction) const;
  glm::mat2 curvature(const ObjectPoint& point, const Surface& s) const;
  glm::mat2 spread_seen(const ObjectPoint& point, double width_m, const Surface& s) const;
  float turn_along(const Branch& branch, const ObjectPoint& point, const Surface& s) const;
  Rgb sharp_glint(const Surface& s, const glm::vec3& in, const glm::mat2& spread) const;
  static Rgb wide_glint(const Surface& s, const glm::vec3& in, const glm::mat2& spread);
  Rgb glint(const ObjectPoint& point, const Surface& s, const glm::mat2& spread, double turn) const;
  std::optional<glm::dvec3> lit_from(const ObjectPoint& point, const Surface& s, const glm::vec3& direction) const;
  bool shares_sky(const Surface& s) const;
  float light_density(const glm::vec3& direction, float width_rad, std::size_t step) const;
  static float lobe_part(float lobe_density, float light_density);
  Rgb sky_highlight(const ObjectPoint& point, const Surface& s, float samples, std::size_t first,
                    std::size_t step) const;
  bool finds_sky_behind(bool inside, const Surface& s) const;
  Rgb sky_behind(const ObjectPoint& point, const Surface& s, float width_rad, std::size_t pattern) const;
  bool is_behind_rough_glass(const glm::dvec3& x, const glm::vec3& direction) const;
  void spread_from_camera(const CameraPoint& at, const Surface& s, float width_rad, GlossyLight& light,
                          Work& work) const;
  Rgb arriving_at(std::span<const TwoSided> radiance, const ObjectPoint& point, const Surface& s) const;
  Rgb diffuse_of(std::span<const TwoSided> radiance, const ObjectPoint& point, const Surface& s) const;
  Rgb occluded(const ObjectPoint& point, const Surface& s) const;
  Rgb relief_of_direct(const ObjectPoint& point, const Surface& s) const;
  Rgb relief_of_indirect(const ObjectPoint& point, const Surface& s) const;
  void shade_relief(const ObjectPoint& point, const Surface& s, GlossyLight& light) const;
  const Surroundings* surroundings(const ObjectPoint& point, const Surface& s) const;
  static Rgb looked_up(const Surroundings& around, const ObjectPoint& point, const Surface& s);

  const RoomSeen& room_;
  std::span<const TwoSided> sent_, indirect_;
  std::span<const DirectionalLight> sky_;
  float sky_luminance_ = 0.0f; ///< irradiance of all of `sky_`
  GlossySettings settings_;
  std::span<const Sh9Rgb> arriving_;
};

} // namespace daylit
