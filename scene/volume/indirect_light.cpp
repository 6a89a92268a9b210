#include "scene/volume/indirect_light.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/sky/sun.h"
#include "scene/volume/lit_piece.h"

namespace daylit {

namespace {

constexpr int kSunPoints = 64; ///< of the sun's disc

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

/// cos T V: V the surfaces of the room, T the panes on the way.
Rgb IndirectLight::sunlit(const LitSurfaces& lit, const FirstReflection::Element& e, const glm::dvec3& point,
                          const glm::dvec3& to_sun) const {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const double cosine = glm::dot(to_sun, e.normal);
  const glm::dvec3 from = point + 4.0 * static_cast<double>(scene_->surface_offset()) * e.normal;
  if (cosine <= 0.0 ||
      scene_->occluded(scene_->to_local(from), glm::vec3(to_sun), 0.0f, std::numeric_limits<float>::infinity()))
    return Rgb(0.0f);
  return static_cast<float>(cosine) * lit.crossings.met(from, to_sun, kFar).transmittance;
}

/// L = L_sky + reflectance E / pi, E: mean of cos T V over points of the piece, each with its own of the sun's disc.
Rgb IndirectLight::sent(const LitSurfaces& lit, std::size_t element, const FirstReflection::Triangle& piece) const {
  const FirstReflection::Element& e = lit.elements.elements()[element];
  const Rgb of_sky = lit.of_sky.at(element, e, (piece[0] + piece[1] + piece[2]) / 3.0);
  if (lit.sunlit.empty() || !lit.sunlit[element])
    return of_sky;
  const Rgb sunlight = mean_over_piece(piece, [&](const glm::dvec3& point, int k) {
    return sunlit(lit, e, point, lit.direction[static_cast<std::size_t>(37 * k % kSunPoints)]);
  });
  return of_sky + sunlight * e.reflectance * lit.normal_irradiance / std::numbers::pi_v<float>;
}

std::optional<ShRadiance> IndirectLight::at(const glm::dvec3& p) const {
  if (!lit_)
    return sampler_.sample_all(field_, p);
  return lit_->elements.corrected(
      sampler_, field_, p, lit_->stored,
      [&](std::size_t element, const FirstReflection::Triangle& piece) { return sent(*lit_, element, piece); });
}

} // namespace daylit
