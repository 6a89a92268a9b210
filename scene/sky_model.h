#pragma once

// Analytic skies: what daylit-simulate lights its rooms with.

#include <optional>

#include <glm/vec3.hpp>

#include "scene/result.h"
#include "scene/rgb_image.h"

namespace daylit {

/// A distant disc of uniform radiance.
struct SunDisc {
  glm::dvec3 direction{0.0, 0.0, 1.0};   ///< unit, towards the sun
  double angular_radius = 0.00465;       ///< radians (0.533 degrees across)
  Rgb normal_irradiance{0.0f};           ///< on a plane facing the sun, radiance unit x sr
  double solid_angle_sr() const;
  Rgb radiance() const;
};

struct SkyModel {
  enum class Kind { uniform, overcast, clear } kind = Kind::overcast;
  Rgb zenith_radiance{1.0f};  ///< uniform: everywhere above the horizon
  Rgb ground_radiance{0.0f};  ///< below the horizon, unless ground_albedo >= 0
  float ground_albedo = 0.2f; ///< ground radiance = albedo * horizontal irradiance (sky + sun) / pi; < 0: use ground_radiance
  std::optional<SunDisc> sun; ///< clear: shapes the sky around it (CIE S 011 type 12), and is the disc itself

  /// Sky or ground radiance without the sun disc.
  Rgb sky_radiance(const glm::dvec3& unit_direction) const;
  /// With the disc.
  Rgb radiance(const glm::dvec3& unit_direction) const;
  /// Horizontal irradiance of the upper hemisphere, sun included.
  Rgb horizontal_irradiance() const;
};

} // namespace daylit
