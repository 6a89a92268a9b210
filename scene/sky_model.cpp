#include "scene/sky_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace daylit {

namespace {

constexpr double kPi = std::numbers::pi;

// ISO 15469:2004 table 1, type 12: CIE standard clear sky, low illuminance turbidity.
constexpr double kGradationA = -1.0, kGradationB = -0.32;
constexpr double kScatterC = 10.0, kScatterD = -3.0, kScatterE = 0.45;

double gradation(double cos_zenith) {
  return cos_zenith > 1e-9 ? 1.0 + kGradationA * std::exp(kGradationB / cos_zenith) : 1.0;
}

double indicatrix(double cos_chi) {
  const double c = std::clamp(cos_chi, -1.0, 1.0);
  return 1.0 + kScatterC * (std::exp(kScatterD * std::acos(c)) - std::exp(kScatterD * kPi / 2.0)) + kScatterE * c * c;
}

struct GaussRule {
  std::array<double, 64> node, weight; // on (0, 1)
};

/// Gauss-Legendre by Newton iteration on P_64 from the Chebyshev-like first guess (Abramowitz & Stegun 25.4.30).
GaussRule gauss_legendre_64() {
  constexpr int n = 64;
  GaussRule rule{};
  for (int i = 0; i < n; ++i) {
    double x = std::cos(kPi * (i + 0.75) / (n + 0.5)), slope = 1.0;
    for (int step = 0; step < 8; ++step) {
      double p0 = 1.0, p1 = x;
      for (int k = 2; k <= n; ++k) {
        const double p2 = ((2 * k - 1) * x * p1 - (k - 1) * p0) / k;
        p0 = p1;
        p1 = p2;
      }
      slope = n * (x * p1 - p0) / (x * x - 1.0);
      x -= p1 / slope;
    }
    rule.node[i] = 0.5 * (1.0 - x);
    rule.weight[i] = 1.0 / ((1.0 - x * x) * slope * slope);
  }
  return rule;
}

/// Integral of f(chi) phi(Z) cos Z over the upper hemisphere. The integrand has a cone at the sun: the zenith range is
/// split there, and azimuth = pi t^3 (from the sun, symmetric) flattens it, so that 64 x 64 nodes give six digits.
double clear_horizontal_integral(double sun_zenith) {
  const GaussRule rule = gauss_legendre_64();
  const double split = std::clamp(sun_zenith, 0.0, kPi / 2.0);
  double sum = 0.0;
  for (const auto& [from, to] : {std::pair(split, 0.0), std::pair(split, kPi / 2.0)}) {
    for (int i = 0; i < 64; ++i) {
      const double t = rule.node[i], zenith = from + (to - from) * t * t;
      const double cz = std::cos(zenith), sz = std::sin(zenith);
      double ring = 0.0;
      for (int k = 0; k < 64; ++k) {
        const double s = rule.node[k], azimuth = kPi * s * s * s;
        const double cos_chi = sz * std::sin(sun_zenith) * std::cos(azimuth) + cz * std::cos(sun_zenith);
        ring += rule.weight[k] * 2.0 * kPi * 3.0 * s * s * indicatrix(cos_chi);
      }
      sum += rule.weight[i] * std::abs(to - from) * 2.0 * t * ring * gradation(cz) * cz * sz;
    }
  }
  return sum;
}

double gradation_integral() {
  const GaussRule rule = gauss_legendre_64();
  double sum = 0.0;
  for (int i = 0; i < 64; ++i)
    sum += rule.weight[i] * 2.0 * kPi * gradation(rule.node[i]) * rule.node[i];
  return sum;
}

/// Horizontal irradiance for zenith radiance 1, without the sun.
double relative_horizontal_irradiance(const SkyModel& model, double inverse_zenith) {
  if (model.kind == SkyModel::Kind::uniform)
    return kPi;
  if (model.kind == SkyModel::Kind::overcast)
    return 7.0 * kPi / 9.0;
  if (!model.sun)
    return inverse_zenith * gradation_integral();
  return inverse_zenith * clear_horizontal_integral(std::acos(std::clamp(model.sun->direction.z, -1.0, 1.0)));
}

} // namespace

double SunDisc::solid_angle_sr() const {
  const double half = std::sin(0.5 * angular_radius);
  return 4.0 * kPi * half * half;
}

Rgb SunDisc::radiance() const {
  const double s = std::sin(angular_radius);
  return normal_irradiance * static_cast<float>(1.0 / (kPi * s * s));
}

bool SunDisc::contains(const glm::dvec3& d) const {
  // Chord against chord: the cosine of a small angle has no digits left.
  const glm::dvec3 chord = d - direction;
  const double half = 2.0 * std::sin(0.5 * angular_radius);
  return glm::dot(chord, chord) <= half * half;
}

Rgb SkyModel::sky_radiance(const glm::dvec3& d) const { return AnalyticSky(*this).sky_radiance(d); }
Rgb SkyModel::radiance(const glm::dvec3& d) const { return AnalyticSky(*this).radiance(d); }
Rgb SkyModel::horizontal_irradiance() const { return AnalyticSky(*this).horizontal_irradiance(); }

AnalyticSky::AnalyticSky(const SkyModel& model) : model_(model) {
  if (model_.kind == SkyModel::Kind::clear)
    inverse_zenith_ = 1.0 / (gradation(1.0) * (model_.sun ? indicatrix(model_.sun->direction.z) : 1.0));
  diffuse_horizontal_ =
      model_.zenith_radiance * static_cast<float>(relative_horizontal_irradiance(model_, inverse_zenith_));
  ground_ = model_.ground_albedo >= 0.0f ? horizontal_irradiance() * (model_.ground_albedo / std::numbers::pi_v<float>)
                                         : model_.ground_radiance;
}

double AnalyticSky::relative_radiance(const glm::dvec3& d) const {
  switch (model_.kind) {
  case SkyModel::Kind::uniform:
    return 1.0;
  case SkyModel::Kind::overcast:
    return (1.0 + 2.0 * d.z) / 3.0;
  case SkyModel::Kind::clear:
    break;
  }
  return inverse_zenith_ * gradation(d.z) * (model_.sun ? indicatrix(glm::dot(d, model_.sun->direction)) : 1.0);
}

Rgb AnalyticSky::sky_radiance(const glm::dvec3& d) const {
  return d.z < 0.0 ? ground_ : model_.zenith_radiance * static_cast<float>(relative_radiance(d));
}

Rgb AnalyticSky::radiance(const glm::dvec3& d) const {
  const Rgb sky = sky_radiance(d);
  return model_.sun && model_.sun->contains(d) ? sky + model_.sun->radiance() : sky;
}

Rgb AnalyticSky::horizontal_irradiance() const {
  if (!model_.sun)
    return diffuse_horizontal_;
  return diffuse_horizontal_ +
         model_.sun->normal_irradiance * static_cast<float>(std::max(0.0, model_.sun->direction.z));
}

} // namespace daylit
