#include "scene/volume/indirect_light.h"

#include <cmath>
#include <limits>
#include <numbers>

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
  light.field_ = combine(volume, region_radiance(sky, volume.partition), ShOrder::fourth);
  if (const std::optional<SunDisc> sun = small_sun(sky))
    light.add_sun(*sun);
  return light;
}

/// The sun alone in the nodes gives what the volume holds of its first reflection.
void IndirectLight::add_sun(const SunDisc& sun) {
  std::optional<FirstReflection> surfaces = FirstReflection::make(*volume_, *scene_);
  if (!surfaces)
    return;
  SunPatch patch{std::move(*surfaces),
                 ApertureCrossings(volume_->apertures),
                 disc_points(sun, kSunPoints),
                 sun.normal_irradiance,
                 {}};
  std::vector<Rgb> node(static_cast<std::size_t>(volume_->partition.size()), Rgb(0.0f));
  for (const glm::dvec3& d : patch.direction)
    for (const RegionWeight& w : volume_->partition.interpolation(d))
      node[static_cast<std::size_t>(w.region)] +=
          static_cast<float>(w.weight / volume_->partition.solid_angle_sr(w.region) / kSunPoints) *
          sun.normal_irradiance;
  patch.stored = patch.surfaces.radiance(node);
  sun_ = std::make_shared<const SunPatch>(std::move(patch));
}

/// L = reflectance E / pi, mean of cos T over the sun's points that are seen, T: panes on the way.
Rgb IndirectLight::sunlit(const SunPatch& patch, std::size_t element, const glm::dvec3& point) const {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const FirstReflection::Element& e = patch.surfaces.elements()[element];
  const glm::dvec3 from = point + 4.0 * static_cast<double>(scene_->surface_offset()) * e.normal;
  Rgb sum(0.0f);
  for (std::size_t k = choice(point, kStep); k < patch.direction.size(); k += kStep) {
    const glm::dvec3& d = patch.direction[k];
    const double cosine = glm::dot(d, e.normal);
    if (cosine > 0.0 && !scene_->occluded(scene_->to_local(from), glm::vec3(d), 0.0f, static_cast<float>(kFar)))
      sum += static_cast<float>(cosine) * patch.crossings.met(from, d, kFar).transmittance;
  }
  return sum * e.reflectance * patch.normal_irradiance *
         (static_cast<float>(kStep) / static_cast<float>(patch.direction.size()) / std::numbers::pi_v<float>);
}

std::optional<ShRadiance> IndirectLight::at(const glm::dvec3& p) const {
  if (!sun_)
    return sampler_.sample_all(field_, p);
  return sun_->surfaces.corrected(sampler_, field_, p, sun_->stored,
                                  [&](std::size_t element, const glm::dvec3& y) { return sunlit(*sun_, element, y); });
}

} // namespace daylit
