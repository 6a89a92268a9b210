#pragma once

// Materials and directions for the tests of their reflection.

#include <cmath>
#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/material/bsdf.h"

namespace daylit::test {

inline double radical_inverse(std::uint32_t base, std::uint32_t n) {
  double result = 0.0, digit = 1.0 / base;
  for (; n > 0; n /= base, digit /= base)
    result += n % base * digit;
  return result;
}
/// Point of the unit cube (Hammersley 1960).
inline glm::vec3 cube_point(std::uint32_t n, std::uint32_t count) {
  return {(n + 0.5) / count, radical_inverse(2, n), radical_inverse(3, n)};
}
inline glm::vec3 direction(float cosine, float azimuth) {
  const float sine = std::sqrt((1.0f - cosine) * (1.0f + cosine));
  return {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
}

inline SurfaceMaterial rough(float roughness) {
  SurfaceMaterial m;
  m.base_colour = Rgb(1.0f);
  m.alpha_u = m.alpha_v = roughness * roughness;
  return m;
}
inline SurfaceMaterial metal(float roughness) {
  SurfaceMaterial m = rough(roughness);
  m.metallic = 1.0f;
  return m;
}
inline SurfaceMaterial glass(float roughness, float ior = 1.5f) {
  SurfaceMaterial m = rough(roughness);
  m.transmission = 1.0f;
  m.ior = ior;
  return m;
}
inline SurfaceMaterial thin(float roughness) {
  SurfaceMaterial m = glass(roughness);
  m.thin = true;
  return m;
}
inline SurfaceMaterial mixture(float roughness) {
  SurfaceMaterial m = rough(roughness);
  m.metallic = 0.3f;
  m.transmission = 0.4f;
  return m;
}
inline SurfaceMaterial coated(SurfaceMaterial m, float coat_roughness) {
  m.clearcoat = 1.0f;
  m.clearcoat_alpha = coat_roughness * coat_roughness;
  return m;
}
inline SurfaceMaterial stretched(SurfaceMaterial m, float anisotropy) {
  m.alpha_u += (1.0f - m.alpha_u) * anisotropy * anisotropy;
  return m;
}
inline SurfaceMaterial lobed(const LafortuneLobe& lobe, float base = 1.0f) {
  SurfaceMaterial m;
  m.base_colour = Rgb(base);
  m.lobe = lobe;
  return m;
}
inline const glm::vec3 kPhong(-1.0f, -1.0f, 1.0f), kBack(1.0f, 1.0f, 1.0f), kBrushed(-0.7f, -1.0f, 0.9f),
    kOffSpecular(-1.0f, -1.0f, 0.7f);

inline const std::vector<float> kRoughnesses = {0.02f, 0.05f, 0.1f, 0.2f, 0.3f, 0.45f, 0.6f, 0.8f, 1.0f};
inline const std::vector<float> kCosines = {0.05f, 0.1f,  0.2f,  0.35f,  0.6f,  0.8f, 1.0f,
                                            -0.1f, -0.3f, -0.6f, -0.74f, -0.8f, -1.0f};

/// Light that goes on from `out` when 1 comes from everywhere.
inline glm::dvec3 furnace(const Bsdf& bsdf, const glm::vec3& out, std::uint32_t count = 1u << 13) {
  glm::dvec3 sum(0.0);
  for (std::uint32_t n = 0; n < count; ++n)
    if (const auto s = bsdf.sample(out, cube_point(n, count)))
      sum += glm::dvec3(s->weight);
  return sum / static_cast<double>(count);
}

} // namespace daylit::test
