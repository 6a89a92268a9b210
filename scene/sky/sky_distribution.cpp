#include "scene/sky/sky_distribution.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "sh/quadrature.h"

namespace daylit {

namespace {

constexpr double kPi = std::numbers::pi;

struct CieRow {
  double a, b, c, d, e;
};

/// ISO 15469:2004 (CIE S 011), table 1: gradation a, b and indicatrix c, d, e of types 1 to 15.
constexpr std::array<CieRow, 15> kCieTable{{{4.0, -0.70, 0, -1.0, 0.00},
                                            {4.0, -0.70, 2, -1.5, 0.15},
                                            {1.1, -0.80, 0, -1.0, 0.00},
                                            {1.1, -0.80, 2, -1.5, 0.15},
                                            {0.0, -1.00, 0, -1.0, 0.00},
                                            {0.0, -1.00, 2, -1.5, 0.15},
                                            {0.0, -1.00, 5, -2.5, 0.30},
                                            {0.0, -1.00, 10, -3.0, 0.45},
                                            {-1.0, -0.55, 2, -1.5, 0.15},
                                            {-1.0, -0.55, 5, -2.5, 0.30},
                                            {-1.0, -0.55, 10, -3.0, 0.45},
                                            {-1.0, -0.32, 10, -3.0, 0.45},
                                            {-1.0, -0.32, 16, -3.0, 0.30},
                                            {-1.0, -0.15, 16, -3.0, 0.30},
                                            {-1.0, -0.15, 24, -2.8, 0.15}}};

} // namespace

/// phi(Z) = 1 + a exp(b / cos Z) (ISO 15469; Perez, Seals & Michalsky 1993, eq. 1).
double SkyDistribution::gradation(double cos_zenith) const {
  if (a == 0.0)
    return 1.0;
  // exp(b / cos Z) vanishes at the horizon for b < 0; for b > 0 it is held.
  const double least = b > 0.0 ? kLowestAltitude : 1e-9;
  return std::max(0.0, 1.0 + a * std::exp(b / std::max(cos_zenith, least)));
}

/// f(chi) = base + c exp(d chi) + e cos^2 chi, chi the angle from the sun, radians (ISO 15469; Perez et al. 1993, eq.
/// 1).
double SkyDistribution::indicatrix(double cos_chi) const {
  if (!depends_on_sun())
    return base;
  const double cosine = std::clamp(cos_chi, -1.0, 1.0);
  return std::max(0.0, base + c * std::exp(d * std::acos(cosine)) + e * cosine * cosine);
}

/// phi(Z) f(chi): radiance over a constant.
double SkyDistribution::relative(const glm::dvec3& direction, const glm::dvec3& sun) const {
  return gradation(direction.z) * indicatrix(glm::dot(direction, sun));
}

/// Integral of phi(Z) f(chi) cos Z over the upper hemisphere, cos chi = sin Z sin Z_s cos(azimuth) + cos Z cos Z_s.
/// Product rule of 64 x 64 Gauss-Legendre nodes on both sides of the sun's zenith angle.
/// The integrand has a cone at the sun: the zenith range is split there, and azimuth = pi t^3 (from the sun,
/// symmetric) flattens it.
double SkyDistribution::horizontal_integral(double cos_sun_zenith) const {
  static const sh::LatitudeRule rule = *sh::gauss_legendre(64);
  const auto node = [](std::size_t i) { return 0.5 * (1.0 - rule.cos_theta[i]); }; // on (0, 1), weights sum to 2
  const double sun_cos = std::clamp(cos_sun_zenith, -1.0, 1.0), sun_sin = std::sqrt(1.0 - sun_cos * sun_cos);
  const double split = std::min(std::acos(sun_cos), kPi / 2.0);
  double sum = 0.0;
  for (const auto& [from, to] : {std::pair(split, 0.0), std::pair(split, kPi / 2.0)}) {
    for (std::size_t i = 0; i < 64; ++i) {
      const double t = node(i), zenith = from + (to - from) * t * t;
      const double cz = std::cos(zenith), sz = std::sin(zenith);
      double ring = 0.0;
      for (std::size_t k = 0; k < 64; ++k) {
        const double s = node(k), azimuth = kPi * s * s * s;
        ring += rule.weight[k] * kPi * 3.0 * s * s * indicatrix(sz * sun_sin * std::cos(azimuth) + cz * sun_cos);
      }
      sum += rule.weight[i] * std::abs(to - from) * t * ring * gradation(cz) * cz * sz;
    }
  }
  return sum;
}

/// base = 1 - c exp(d pi / 2): f(pi/2) is then 1, as ISO 15469 has it.
Result<SkyDistribution> cie_sky(int type) {
  if (type < 1 || type > 15)
    return Error{ErrorCode::value_invalid, fmt::format("{} is not a type of the CIE general sky", type), "cie_type",
                 "types are 1 to 15"};
  const CieRow& row = kCieTable[static_cast<std::size_t>(type - 1)];
  return SkyDistribution{row.a, row.b, row.c, row.d, row.e, 1.0 - row.c * std::exp(row.d * kPi / 2.0)};
}

} // namespace daylit
