#pragma once

// Light that comes to a point straight from the sky through windows and holes: the part that the volume does not hold.

#include <vector>

#include <glm/vec3.hpp>

#include "scene/room/ray_scene.h"
#include "scene/room/room.h"
#include "scene/sky/sky.h"

namespace daylit {

/// Integral over what a WindowView sees: radiance at the middle of small cells times their exact cosine-weighted area.
/// Small bright things are not left to the cells: the sun of a description is the visible part of its disc, and what a
/// texel of a picture has above a cap (a sun) is the visible part of that texel. Keeps references: room data and sky
/// must outlive it. Thread-safe.
class DirectSky {
public:
  DirectSky(const Room& room, const std::vector<Aperture>& apertures, const RayScene& scene, const Sky& sky);

  /// Irradiance (radiance unit x sr) on a surface at `point` facing `unit_normal`, without any reflection.
  Rgb irradiance(const glm::dvec3& point, const glm::dvec3& unit_normal) const;

private:
  struct BrightSpot {
    std::vector<glm::dvec3> cone;
    glm::dvec3 radiance{0.0}; ///< above the cap, scaled so that the cone has the spot's energy
  };
  void find_bright_texels(const SkyImage& image);

  const Room& room_;
  const std::vector<Aperture>& apertures_;
  const RayScene& scene_;
  const Sky& sky_;
  float cap_ = 0.0f; ///< luminance of the cells' radiance at most; 0: none
  std::vector<BrightSpot> bright_;
};

} // namespace daylit
