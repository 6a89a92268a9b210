#pragma once

// Light that reaches a point straight from the sky through windows and holes: the part that the volume leaves out.

#include <cstddef>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/ray_scene.h"
#include "scene/room.h"
#include "scene/sky_image.h"

namespace daylit {

/// Quadrature over the spherical polygons under which the apertures appear. A texel much brighter than the mean (the
/// sun) is not left to chance: what it has above a cap is added texel by texel. Keeps references: room data and sky
/// must outlive it. Thread-safe.
class DirectSky {
public:
  DirectSky(const std::vector<Aperture>& apertures, const RayScene& scene, const SkyImage& sky);

  /// Irradiance (radiance unit x sr) on a surface at `point` facing `unit_normal`, without any reflection.
  Rgb irradiance(const glm::dvec3& point, const glm::dvec3& unit_normal) const;

private:
  struct BrightTexel {
    std::size_t index = 0;
    Rgb excess{0.0f}; ///< radiance above the cap
  };
  struct Receiver;
  glm::dvec3 polygon_light(const Receiver& at, std::size_t aperture) const;
  glm::dvec3 bright_light(const Receiver& at) const;
  bool enters_elsewhere_first(const glm::dvec3& p, const glm::dvec3& d, std::size_t aperture) const;
  bool sees_sky(const Receiver& at, const glm::dvec3& d) const;

  const std::vector<Aperture>& apertures_;
  const RayScene& scene_;
  const SkyImage& sky_;
  float cap_ = 0.0f;
  std::vector<BrightTexel> bright_;
};

} // namespace daylit
