#pragma once

// Radiance along a ray among virtual objects that mirror and refract: ray by ray, the brighter branch first, until what
// is left cannot be seen (Whitted 1980; rough surfaces by samples of their lobe, Walter et al. 2007).

#include <optional>
#include <span>

#include "runtime/object/object_rays.h"
#include "runtime/object/relight.h"
#include "runtime/reflect/room_seen.h"
#include "scene/material/bsdf.h"
#include "scene/model/surface_look.h"

namespace daylit {

struct GlossySettings {
  int most_rays = 8;              ///< after the camera's, of one sample of a pixel
  float least_importance = 0.01f; ///< a branch that brings less of its light to the camera is left out
  bool shadows = true;            ///< the sun's glint is looked for behind what stands before it
};

/// What a sample of a pixel shows of an object whose material is looked up.
struct GlossyLight {
  Rgb diffuse{1.0f};      ///< reflectance of the diffuse part: times irradiance / pi is its radiance
  Rgb radiance{0.0f};     ///< all that is not diffuse: mirrored, refracted, sent by itself
  glm::vec3 normal{0.0f}; ///< of the shading, world
  float alpha = 0.0f;     ///< slope of the narrowest lobe; 0 where none is followed
};

/// From this slope on a lobe takes several rays, which neighbouring pixels share. Below, it shows sharp pictures.
constexpr float kWideAlpha = 0.01f;

/// Keeps references to what it is made of. Thread-safe.
class GlossyRays {
public:
  /// `sent`: radiance of each vertex of all objects as a diffuse surface, on both sides.
  GlossyRays(const RoomSeen& room, std::span<const TwoSided> sent, const GlossySettings& settings);

  /// At a point that the camera's ray meets. `places`: of the unit square, where in the lobe rays go; the first is
  /// enough where the lobe is narrow. `width_m`: of the pixel on the surface. `rays`: those traced are added.
  GlossyLight look(const WorldRay& ray, const ObjectPoint& point, std::span<const glm::vec2> places, double width_m,
                   std::uint64_t& rays) const;
  /// Along a ray from outside the objects: what it meets first, of them or of the room.
  Rgb radiance(const WorldRay& ray) const;
  const ObjectMaterial* material(const ObjectPoint& point) const;

private:
  struct Path {
    int rays_left = 0;
    int depth = 0;
    glm::vec2 u{0.5f};
    std::uint64_t rays = 0;
  };
  struct Surface;
  Surface surface(const WorldRay& ray, const ObjectPoint& point, double width_m) const;
  Rgb along(const WorldRay& ray, float importance, const Rgb& absorption_per_m, bool with_disc, Path& path) const;
  Rgb glossy(const ObjectPoint& point, const Surface& s, float importance, Path& path) const;
  Rgb branch(const ObjectPoint& point, const Surface& s, const BsdfSample& sample, float importance, Path& path) const;
  Rgb glint(const ObjectPoint& point, const Surface& s) const;
  Rgb sent_by(const ObjectPoint& point, const Surface& s) const;

  const RoomSeen& room_;
  std::span<const TwoSided> sent_;
  GlossySettings settings_;
};

} // namespace daylit
