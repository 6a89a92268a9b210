#pragma once

// The shape of a daylight sky: relative radiance above the horizon as gradation times indicatrix,
//   l(Z, chi) = phi(Z) f(chi),  phi = 1 + a exp(b / cos Z),  f = base + c exp(d chi) + e cos^2 chi,
// Z = zenith angle, chi = angle to the sun. The CIE standard general sky (CIE S 011 / ISO 15469:2004) and the
// all-weather sky of Perez, Seals and Michalsky (Solar Energy 50, 1993) are both of this form; CIE writes
// base = 1 - c exp(d pi/2), which makes f = 1 a right angle away from the sun, Perez base = 1.

#include <glm/vec3.hpp>

#include "scene/core/result.h"

namespace daylit {

struct SkyDistribution {
  double a = 0.0, b = -1.0, c = 0.0, d = -1.0, e = 0.0, base = 1.0;

  /// phi >= 0. With b > 0 it has a pole at the horizon: below kLowestAltitude it keeps the value there.
  double gradation(double cos_zenith) const;
  /// f >= 0.
  double indicatrix(double cos_chi) const;
  /// phi f. Unit vectors, direction.z >= 0.
  double relative(const glm::dvec3& direction, const glm::dvec3& sun) const;
  /// Has the sun a part in the shape?
  bool depends_on_sun() const { return c != 0.0 || e != 0.0; }
  /// Integral of phi f cos Z over the upper hemisphere, six digits where neither factor is cut off at 0.
  double horizontal_integral(double cos_sun_zenith) const;

  static constexpr double kLowestAltitude = 0.01; ///< radians
};

/// Table 1 of ISO 15469:2004. Type 1..15; 5 is uniform, 12 the clear sky of low turbidity. (Type 16, the traditional
/// overcast sky (1 + 2 sin g) / 3, is not of this form: SkyModel::Kind::overcast.)
Result<SkyDistribution> cie_sky(int type);

} // namespace daylit
