#include "scene/model/mtl_material.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <glm/common.hpp>

// Wavefront's MTL (appendix B5 of its manual) describes highlights of lamps by Phong's model; these are the rules by
// which it becomes a surface of microfacets.

namespace daylit::detail {

namespace {

constexpr double kSmoothExponent = 1000.0; // the top of Ns in the manual: a mirror
constexpr double kGlassIndex = 1.5;        // KHR_materials_ior's, where Ni is missing
constexpr float kHighlightF0 = 0.08f;      // of Ks = 1: 0.5, which most programs write, is glass or varnish, 4 %

bool in_unit_range(const Rgb& c) { return c.r >= 0 && c.r <= 1 && c.g >= 0 && c.g <= 1 && c.b >= 0 && c.b <= 1; }

/// Blinn's exponent and the slope of microfacets: alpha^2 = 2 / (Ns + 2) (Walter et al. 2007, section 5.2); roughness
/// is the root of alpha.
float roughness_of(double exponent) {
  return exponent >= kSmoothExponent ? 0.0f : static_cast<float>(std::pow(2.0 / (exponent + 2.0), 0.25));
}

/// Index whose reflectance face on is f0: ((n - 1) / (n + 1))^2 = f0.
float index_of(float f0) { return (1.0f + std::sqrt(f0)) / (1.0f - std::sqrt(f0)); }

bool is_ray_traced_glass(double illum) { return illum == 4 || illum == 6 || illum == 7 || illum == 9; }
bool is_mirror(double illum) { return illum == 3 || illum == 5 || illum == 8; }

/// A mirror of Ks over a diffuse surface of Kd: metal to the part that Ks has in both. What reflects more than it gets
/// is scaled down.
void set_mirror(const Rgb& kd, const Rgb& ks, ObjectMaterial& m) {
  const float mirrored = luminance(ks), both = luminance(kd + ks);
  const Rgb sum = kd + ks;
  m.base_colour = sum / std::max({1.0f, sum.r, sum.g, sum.b});
  m.metallic = both > 0.0f ? mirrored / both : 0.0f;
}

void set_glass(const MtlMaterial& mtl, bool ray_traced, ObjectMaterial& m) {
  const double opacity = mtl.opacity.value_or(1.0);
  m.transmission = opacity < 1.0 ? static_cast<float>(1.0 - opacity) : 1.0f;
  m.ior = static_cast<float>(mtl.refractive_index.value_or(ray_traced ? kGlassIndex : 1.0));
  m.thin = m.ior == 1.0f; // a veil: light goes straight on
  if (opacity >= 1.0)
    m.base_colour = mtl.transmittance.value_or(Rgb(1.0f));
  if (!mtl.roughness)
    m.roughness = 0.0f;
}

Result<void> check_numbers(const MtlMaterial& mtl, const std::string& where) {
  const auto error = [&](const std::string& what, const char* hint) {
    return Error{ErrorCode::value_invalid, what, where, hint};
  };
  for (const auto& [name, colour] : {std::pair("Kd", mtl.reflectance), std::pair("Ks", mtl.specular)})
    if (colour && !in_unit_range(*colour))
      return error(fmt::format("reflectance {} outside 0..1", name), "give it between 0 and 1");
  if (const double ns = mtl.exponent.value_or(0.0); !(ns >= 0.0) || std::isinf(ns))
    return error(fmt::format("Ns is {:g}, below 0 or not finite", ns), "give an exponent from 0 to 1000");
  if (const double d = mtl.opacity.value_or(1.0); !(d >= 0.0 && d <= 1.0))
    return error(fmt::format("d is {:g} (or Tr {:g}), outside 0..1", d, 1.0 - d), "give it between 0 and 1");
  if (const double i = mtl.illumination.value_or(2.0); !(i >= 0.0 && i <= 10.0) || i != std::floor(i))
    return error(fmt::format("illum is {:g}, no illumination model", i), "models are 0 to 10");
  return {};
}

/// The extension for physically based materials wins; else illum says what Ks and Ns mean.
void set_gloss(const MtlMaterial& mtl, ObjectMaterial& m) {
  const Rgb ks = mtl.specular.value_or(Rgb(0.0f));
  const double illum = mtl.illumination.value_or(2.0);
  if (mtl.roughness || mtl.metallic) {
    m.roughness = static_cast<float>(mtl.roughness.value_or(static_cast<double>(m.roughness)));
    m.metallic = static_cast<float>(mtl.metallic.value_or(0.0));
    m.ior = static_cast<float>(mtl.refractive_index.value_or(kGlassIndex));
  } else if (is_mirror(illum)) {
    m.roughness = mtl.exponent ? m.roughness : 0.0f;
    set_mirror(m.base_colour, ks, m);
  } else if (illum >= 2.0 && ks != Rgb(0.0f)) {
    m.ior = index_of(kHighlightF0 * luminance(ks));
  } else {
    m.roughness = 1.0f;
  }
}

} // namespace

Result<ObjectMaterial> material_from_mtl(const MtlMaterial& mtl, Rgb fallback, const std::string& where) {
  if (const auto checked = check_numbers(mtl, where); !checked)
    return checked.error();
  ObjectMaterial m{.name = mtl.name};
  m.base_colour = mtl.reflectance.value_or(mtl.texture.file.empty() ? fallback : Rgb(1.0f));
  m.roughness = roughness_of(mtl.exponent.value_or(0.0));
  m.emission = mtl.emission.value_or(Rgb(0.0f));
  set_gloss(mtl, m);
  m.clearcoat = static_cast<float>(mtl.clearcoat.value_or(0.0));
  m.clearcoat_roughness = static_cast<float>(mtl.clearcoat_roughness.value_or(0.0));
  m.anisotropy = static_cast<float>(mtl.anisotropy.value_or(0.0));
  m.anisotropy_rotation = static_cast<float>(2.0 * std::numbers::pi * mtl.anisotropy_turns.value_or(0.0));
  if (const bool traced = is_ray_traced_glass(mtl.illumination.value_or(2.0));
      traced || mtl.opacity.value_or(1.0) < 1.0)
    set_glass(mtl, traced, m);
  if (const auto checked = check_material(m, where); !checked)
    return checked.error();
  return m;
}

} // namespace daylit::detail
