#include "scene/volume/indirect_light.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/sky/sun.h"

namespace daylit {

namespace {

constexpr int kSunPoints = 64;
/// Of them each point of a surface takes every fourth: 25 m from its window a patch has a penumbra of 0.2 m.
constexpr std::size_t kStep = 4;

/// One of `count`, by the coordinates' digits: points of a surface that lie close together take different ones.
std::size_t choice(const glm::dvec3& p, std::size_t count) {
  const double x = 7919.13 * p.x + 10472.97 * p.y + 15485.63 * p.z;
  return std::min(count - 1, static_cast<std::size_t>((x - std::floor(x)) * static_cast<double>(count)));
}

} // namespace

Result<IndirectLight> IndirectLight::make(const BasisVolume& volume, const RayScene& scene, const Sky& sky) {
  Result<LightFieldSampler> sampler = LightFieldSampler::make(volume);
  if (!sampler)
    return sampler.error();
  IndirectLight light(volume, scene, std::move(*sampler));
  const std::vector<Rgb> radiance = region_radiance(sky, volume.partition);
  light.field_ = combine(volume, radiance, ShOrder::fourth);
  light.add_surfaces(radiance, small_sun(sky));
  return light;
}

void IndirectLight::add_surfaces(std::span<const Rgb> node_radiance, const std::optional<SunDisc>& sun) {
  std::optional<FirstReflection> elements = FirstReflection::make(*volume_, *scene_);
  if (!elements)
    return;
  LitSurfaces lit{std::move(*elements), ApertureCrossings(volume_->apertures), {}, {}, {}, {}, Rgb(0.0f)};
  lit.stored = lit.elements.radiance(node_radiance);
  std::vector<Rgb> of_sky = lit.stored;
  if (sun) {
    lit.direction = disc_points(*sun, kSunPoints);
    lit.normal_irradiance = sun->normal_irradiance;
    std::vector<Rgb> node(node_radiance.size(), Rgb(0.0f));
    for (const glm::dvec3& d : lit.direction)
      for (const RegionWeight& w : volume_->partition.interpolation(d))
        node[static_cast<std::size_t>(w.region)] +=
            static_cast<float>(w.weight / volume_->partition.solid_angle_sr(w.region) / kSunPoints) *
            sun->normal_irradiance;
    const std::vector<Rgb> of_sun = lit.elements.radiance(node);
    for (std::size_t e = 0; e < of_sun.size(); ++e) {
      of_sky[e] = glm::max(of_sky[e] - of_sun[e], Rgb(0.0f));
      lit.sunlit.push_back(of_sun[e] != Rgb(0.0f));
    }
  }
  lit.of_sky = LinearRadiance(lit.elements.elements(), of_sky);
  lit_ = std::make_shared<const LitSurfaces>(std::move(lit));
}

/// L = L_sky + reflectance E / pi, E: mean of cos T over the sun's points that are seen, T: panes on the way.
Rgb IndirectLight::sent(const LitSurfaces& lit, std::size_t element, const glm::dvec3& point) const {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const FirstReflection::Element& e = lit.elements.elements()[element];
  const Rgb of_sky = lit.of_sky.at(element, e, point);
  if (lit.sunlit.empty() || !lit.sunlit[element])
    return of_sky;
  const glm::dvec3 from = point + 4.0 * static_cast<double>(scene_->surface_offset()) * e.normal;
  Rgb sum(0.0f);
  for (std::size_t k = choice(point, kStep); k < lit.direction.size(); k += kStep) {
    const glm::dvec3& d = lit.direction[k];
    const double cosine = glm::dot(d, e.normal);
    if (cosine > 0.0 && !scene_->occluded(scene_->to_local(from), glm::vec3(d), 0.0f, static_cast<float>(kFar)))
      sum += static_cast<float>(cosine) * lit.crossings.met(from, d, kFar).transmittance;
  }
  return of_sky + sum * e.reflectance * lit.normal_irradiance *
                      (static_cast<float>(kStep) / static_cast<float>(kSunPoints) / std::numbers::pi_v<float>);
}

std::optional<ShRadiance> IndirectLight::at(const glm::dvec3& p) const {
  if (!lit_)
    return sampler_.sample_all(field_, p);
  return lit_->elements.corrected(sampler_, field_, p, lit_->stored,
                                  [&](std::size_t element, const glm::dvec3& y) { return sent(*lit_, element, y); });
}

} // namespace daylit
