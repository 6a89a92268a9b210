#include "scene/sky/sky_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace daylit {

namespace {

constexpr double kPi = std::numbers::pi;

} // namespace

/// 2 pi (1 - cos r) = 4 pi sin^2(r/2), steradians; the second form keeps its digits for small r.
double SunDisc::solid_angle_sr() const {
  const double half = std::sin(0.5 * angular_radius);
  return 4.0 * kPi * half * half;
}

/// L = E_n / (pi sin^2 r): a disc of even radiance around the normal has the projected solid angle pi sin^2 r.
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

/// L(d) = scale * relative(d). The scale comes from the diffuse horizontal irradiance E_d = integral of L cos Z over
/// the upper hemisphere, or from the zenith radiance. Ground: L = albedo (E_d + E_sun) / pi.
AnalyticSky::AnalyticSky(const SkyModel& model) : model_(model) {
  if (model_.kind == SkyModel::Kind::clear)
    model_.distribution = *cie_sky(12);
  if (!model_.sun) // gradation only
    model_.distribution.c = model_.distribution.e = 0.0, model_.distribution.base = 1.0;
  const double integral = relative_integral();
  if (model_.diffuse_horizontal)
    scale_ = *model_.diffuse_horizontal * static_cast<float>(1.0 / integral);
  else
    scale_ = model_.zenith_radiance * static_cast<float>(1.0 / relative_radiance({0.0, 0.0, 1.0}));
  diffuse_horizontal_ = model_.diffuse_horizontal.value_or(scale_ * static_cast<float>(integral));
  ground_ = model_.ground_albedo >= 0.0f ? horizontal_irradiance() * (model_.ground_albedo / std::numbers::pi_v<float>)
                                         : model_.ground_radiance;
}

/// Radiance over a constant. Overcast: CIE standard overcast sky, L/L_zenith = (1 + 2 sin altitude) / 3 (Moon & Spencer
/// 1942). Clear: CIE type 12. Others: SkyDistribution.
double AnalyticSky::relative_radiance(const glm::dvec3& d) const {
  switch (model_.kind) {
  case SkyModel::Kind::uniform:
    return 1.0;
  case SkyModel::Kind::overcast:
    return (1.0 + 2.0 * d.z) / 3.0;
  case SkyModel::Kind::clear:
  case SkyModel::Kind::general:
    break;
  }
  return model_.distribution.relative(d, model_.sun ? model_.sun->direction : glm::dvec3(0.0, 0.0, 1.0));
}

/// Of relative_radiance cos Z over the upper hemisphere.
double AnalyticSky::relative_integral() const {
  if (model_.kind == SkyModel::Kind::uniform)
    return kPi;
  if (model_.kind == SkyModel::Kind::overcast)
    // 2 pi times the integral of (1 + 2 z) z / 3 over z = cos Z in 0..1
    return 7.0 * kPi / 9.0;
  return model_.distribution.horizontal_integral(model_.sun ? model_.sun->direction.z : 1.0);
}

Rgb AnalyticSky::sky_radiance(const glm::dvec3& d) const {
  return d.z < 0.0 ? ground_ : scale_ * static_cast<float>(relative_radiance(d));
}

Rgb AnalyticSky::radiance(const glm::dvec3& d) const {
  const Rgb sky = sky_radiance(d);
  return model_.sun && model_.sun->contains(d) ? sky + model_.sun->radiance() : sky;
}

/// E = E_d + E_n sin(altitude of the sun), radiance unit times steradian.
Rgb AnalyticSky::horizontal_irradiance() const {
  if (!model_.sun)
    return diffuse_horizontal_;
  return diffuse_horizontal_ +
         model_.sun->normal_irradiance * static_cast<float>(std::max(0.0, model_.sun->direction.z));
}

} // namespace daylit
