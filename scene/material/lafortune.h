#pragma once

// A lobe of Lafortune et al. 1997 ("Non-linear approximation of reflectance functions"), rho_s (in . C out)^n, as
// Pessoa et al. 2012 (section 4.2) have it: one lobe over a diffuse base, with more of it at grazing angles. Directions
// are unit vectors in a local frame, z the surface's normal on the side that is seen, x the tangent.

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/image/rgb_image.h"

namespace daylit {

/// The lobe seen from one direction: a power of the cosine to its peak.
struct LafortunePeak {
  glm::vec3 direction{0.0f, 0.0f, 1.0f}; ///< unit, C out
  Rgb strength{0.0f};                    ///< part of light at most: rho_s' |C out|^n'
  float exponent = 1.0f;                 ///< n'
  float grazing = 0.0f;                  ///< f(out) of eq. 10: what the effect at grazing angles has done

  /// BRDF times the cosine of `in`, per sr:
  /// strength (p.in)^n' ((1 - f) (n' + 2) / (2 pi) cos + f (n' + 1) / (2 pi)).
  /// Paper, eq. 9 and 13: g = N.p in the place of the first term's cosine, its mean over the lobe; g + (1 - g) f is the
  /// same sum. Each term's integral is at most 1, less what falls below the surface.
  Rgb sent(const glm::vec3& in) const;
  /// Direction with the density below, `u` of the unit square; it may lie below the surface.
  glm::vec3 sample(const glm::vec2& u) const;
  float density(const glm::vec3& in) const; ///< per sr: (n' + 1) / (2 pi) (p.in)^n'
  /// Integral of sent(), exact for narrow lobes well above the surface; its mean over all directions is within 2 % (n =
  /// 1).
  Rgb albedo() const;
};

struct LafortuneLobe {
  Rgb weight{0.0f};                ///< rho_s, 0..1: part of light sent along a normal, in the lobe
  glm::vec3 c{-1.0f, -1.0f, 1.0f}; ///< C: (-1, -1, 1) mirrors, (1, 1, 1) sends back; scaled so that the largest is 1
  float exponent = 20.0f;          ///< n, 1 to kMostExponent
  float grazing = 0.0f;            ///< f_w, 0..1: how far weight and exponent rise to their most at grazing angles
  float falloff = 5.0f;            ///< phi: at an angle t to the normal by (1 - cos t)^phi
  static constexpr float kMostExponent = 1e4f;

  /// `out`.z >= 0. Paper, eq. 8 to 13. Its glossiness, 0..1, is ln n / ln kMostExponent here.
  LafortunePeak peak(const glm::vec3& out) const;
  /// Albedo of a diffuse base of that colour: as much of it as the lobe leaves at most, 1 - rho_s' being
  /// (1 - rho_s) (1 - f).
  Rgb base(const Rgb& colour, const LafortunePeak& seen) const;
  /// Slope of the microfacets (Ggx) whose reflection is as wide: Blinn's exponent is four times Phong's.
  float alpha() const;
  bool operator==(const LafortuneLobe&) const = default;
};

} // namespace daylit
