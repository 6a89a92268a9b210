#pragma once

// Analytic skies. Directions are unit vectors in the world frame (z up) that point to where the light comes from;
// radiances are linear Rec. 709 RGB.

#include <optional>

#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/sky/sky_distribution.h"

namespace daylit {

/// A distant disc of uniform radiance. Its whole disc stands above or below the horizon where irradiances are asked.
struct SunDisc {
  glm::dvec3 direction{0.0, 0.0, 1.0}; ///< unit, towards the sun
  double angular_radius = 0.00465;     ///< radians (0.533 degrees across), 0 < angular_radius < pi/2
  Rgb normal_irradiance{0.0f};         ///< on a plane facing the sun, radiance unit x sr; zero: it only shapes the sky
  double solid_angle_sr() const;
  /// normal_irradiance / (pi sin^2 angular_radius): exact for a uniform disc.
  Rgb radiance() const;
  bool contains(const glm::dvec3& unit_direction) const;
};

/// Parameters of a sky. The member functions prepare an AnalyticSky each time; a caller with more than one query keeps
/// one.
struct SkyModel {
  enum class Kind { uniform, overcast, clear, general } kind = Kind::overcast;
  SkyDistribution distribution; ///< kind general
  Rgb zenith_radiance{1.0f};    ///< uniform: everywhere above the horizon
  /// Scales the sky instead of zenith_radiance: horizontal irradiance of the sky without the sun, radiance unit x sr.
  std::optional<Rgb> diffuse_horizontal;
  Rgb ground_radiance{0.0f}; ///< below the horizon, unless ground_albedo >= 0
  float ground_albedo =
      0.2f; ///< ground radiance = albedo * horizontal irradiance (sky + sun) / pi; < 0: use ground_radiance
  std::optional<SunDisc> sun; ///< shapes the sky around it (clear, general), and is the disc itself

  /// Sky or ground radiance without the sun disc.
  Rgb sky_radiance(const glm::dvec3& unit_direction) const;
  /// With the disc.
  Rgb radiance(const glm::dvec3& unit_direction) const;
  /// Horizontal irradiance of the upper hemisphere, sun included.
  Rgb horizontal_irradiance() const;
};

/// A SkyModel with its normalisation and its ground evaluated once: a few flops per query, safe to use by many threads.
/// uniform:  L = Lz
/// overcast: L = Lz (1 + 2 sin g) / 3, g = altitude (CIE S 011 type 16, Moon & Spencer 1942)
/// clear:    CIE S 011 / ISO 15469 type 12
/// general:  any SkyDistribution
/// The last two: L = Lz l(Z, chi) / l(0, Zs), or E_diffuse l / (integral of l cos Z); without a sun f is 1.
class AnalyticSky {
public:
  explicit AnalyticSky(const SkyModel& model);

  const SkyModel& model() const { return model_; }
  Rgb sky_radiance(const glm::dvec3& unit_direction) const;
  Rgb radiance(const glm::dvec3& unit_direction) const;
  Rgb ground_radiance() const { return ground_; }
  /// Of the sky alone, without the sun.
  Rgb diffuse_horizontal_irradiance() const { return diffuse_horizontal_; }
  Rgb horizontal_irradiance() const;

private:
  SkyModel model_;
  Rgb scale_{0.0f}; ///< radiance where relative_radiance() is 1
  Rgb ground_{0.0f}, diffuse_horizontal_{0.0f};

  double relative_radiance(const glm::dvec3& unit_direction) const;
  double relative_integral() const;
};

} // namespace daylit
