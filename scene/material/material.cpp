#include "scene/material/material.h"

#include <cmath>

#include <fmt/format.h>
#include <glm/common.hpp>

namespace daylit {

namespace {

constexpr float kMost = 1e6f;

struct Quantity {
  const char* name;
  float value, least, most;
};

/// Mean over the hemisphere, cosine weighted, of Fresnel's reflectance of unpolarised light seen from outside: the
/// closed form of Walsh (1926), n > 1.
float mean_fresnel(float ior) {
  if (ior < 1.001f)
    return 0.0f;
  const double n = static_cast<double>(ior), n2 = n * n, n4 = n2 * n2, s = n2 + 1.0, d = n2 - 1.0;
  return static_cast<float>(0.5 + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0) * (n + 1.0)) +
                            n2 * d * d / (s * s * s) * std::log((n - 1.0) / (n + 1.0)) -
                            2.0 * n * n2 * (n2 + 2.0 * n - 1.0) / (s * (n4 - 1.0)) +
                            8.0 * n4 * (n4 + 1.0) / (s * (n4 - 1.0) * (n4 - 1.0)) * std::log(n));
}

} // namespace

Result<void> check_material(const ObjectMaterial& m, const std::string& where) {
  const LafortuneLobe lobe = m.lobe.value_or(LafortuneLobe{});
  const Quantity quantities[] = {{"base colour (red)", m.base_colour.r, 0, 1},
                                 {"base colour (green)", m.base_colour.g, 0, 1},
                                 {"base colour (blue)", m.base_colour.b, 0, 1},
                                 {"metallic", m.metallic, 0, 1},
                                 {"roughness", m.roughness, 0, 1},
                                 {"index of refraction", m.ior, 1, 100},
                                 {"transmission", m.transmission, 0, 1},
                                 {"attenuation colour (red)", m.attenuation_colour.r, 0, 1},
                                 {"attenuation colour (green)", m.attenuation_colour.g, 0, 1},
                                 {"attenuation colour (blue)", m.attenuation_colour.b, 0, 1},
                                 {"attenuation distance", m.attenuation_distance_m, 0, kMost},
                                 {"dispersion", m.dispersion, 0, 100},
                                 {"clear coat", m.clearcoat, 0, 1},
                                 {"roughness of the clear coat", m.clearcoat_roughness, 0, 1},
                                 {"anisotropy", m.anisotropy, 0, 1},
                                 {"rotation of the anisotropy", m.anisotropy_rotation, -kMost, kMost},
                                 {"emission (red)", m.emission.r, 0, 1e12f},
                                 {"emission (green)", m.emission.g, 0, 1e12f},
                                 {"emission (blue)", m.emission.b, 0, 1e12f},
                                 {"scale of the normal map", m.normal_scale, -kMost, kMost},
                                 {"strength of the occlusion", m.occlusion_strength, 0, 1},
                                 {"weight of the lobe (red)", lobe.weight.r, 0, 1},
                                 {"weight of the lobe (green)", lobe.weight.g, 0, 1},
                                 {"weight of the lobe (blue)", lobe.weight.b, 0, 1},
                                 {"coefficient of the lobe (x)", lobe.c.x, -kMost, kMost},
                                 {"coefficient of the lobe (y)", lobe.c.y, -kMost, kMost},
                                 {"coefficient of the lobe (z)", lobe.c.z, 1e-6f, kMost},
                                 {"exponent of the lobe", lobe.exponent, 1, LafortuneLobe::kMostExponent},
                                 {"rise of the lobe at grazing angles", lobe.grazing, 0, 1},
                                 {"falloff of the lobe", lobe.falloff, 0.1f, 100},
                                 {"rotation of the lobe", m.lobe_rotation, -kMost, kMost}};
  for (const Quantity& q : quantities)
    if (!(q.value >= q.least && q.value <= q.most))
      return Error{ErrorCode::value_invalid,
                   fmt::format("{} is {:g}, outside {:g} to {:g}", q.name, q.value, q.least, q.most), where,
                   "correct the material in the program that wrote it"};
  return {};
}

namespace {

/// Midpoint rule in the squared cosine, over two azimuths. `mirrored`: 1, or 0 for the diffuse part alone.
Rgb mean_of_lobe(const LafortuneLobe& lobe, const Rgb& base, float mirrored) {
  constexpr int kSteps = 8;
  Rgb sum(0.0f);
  for (int k = 0; k < 2 * kSteps; ++k) {
    const float z2 = (static_cast<float>(k / 2) + 0.5f) / kSteps, sine = std::sqrt(1.0f - z2);
    const LafortunePeak peak = lobe.peak({k % 2 == 0 ? sine : 0.0f, k % 2 == 0 ? 0.0f : sine, std::sqrt(z2)});
    sum += mirrored * peak.albedo() + lobe.base(base, peak);
  }
  return sum / (2.0f * kSteps);
}

/// After Schlick.
Rgb mean_of_metal(const Rgb& base) { return (20.0f * base + 1.0f) / 21.0f; }

} // namespace

/// A pane of two interfaces reflects 2 F / (1 + F), all inner reflections summed.
Rgb mean_reflectance(const ObjectMaterial& m) {
  if (!m.is_glossy())
    return m.base_colour;
  if (m.lobe)
    return mean_of_lobe(*m.lobe, m.base_colour, 1.0f);
  const float f = mean_fresnel(m.ior), coat = m.clearcoat * mean_fresnel(1.5f);
  const Rgb inside = (1.0f - m.transmission) * m.base_colour + m.transmission * f / (1.0f + f);
  const Rgb dielectric = f + (1.0f - f) * inside;
  return coat + (1.0f - coat) * glm::mix(dielectric, mean_of_metal(m.base_colour), m.metallic);
}

Rgb mean_mirrored_reflectance(const ObjectMaterial& m) {
  if (m.lobe)
    return Rgb(0.0f);
  const float under_coat = 1.0f - m.clearcoat * mean_fresnel(1.5f);
  const float slope = glm::mix(m.roughness * m.roughness, 1.0f, m.anisotropy * m.anisotropy);
  return under_coat * (1.0f - slope) * m.metallic * mean_of_metal(m.base_colour);
}

Rgb mean_diffuse_reflectance(const ObjectMaterial& m) {
  if (!m.is_glossy())
    return m.base_colour;
  if (m.lobe)
    return mean_of_lobe(*m.lobe, m.base_colour, 0.0f);
  const float through = (1.0f - m.clearcoat * mean_fresnel(1.5f)) * (1.0f - mean_fresnel(m.ior));
  return through * (1.0f - m.metallic) * (1.0f - m.transmission) * m.base_colour;
}

} // namespace daylit
