#include "scene/material/library.h"

#include <algorithm>
#include <numbers>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>

// Metals: reflectance face on, linear Rec. 709, from measured refractive indices (refractiveindex.info) as tabulated by
// Akenine-Moller, Haines, Hoffman et al., Real-Time Rendering, 4th edition 2018, table 9.2.
// Indices of refraction and Abbe numbers: soda-lime glass 1.52; flint F2 1.62, 36.4 (Schott); diamond 2.417, 55.3
// (Peter 1923); water 1.333 (Hale and Querry 1973); natural rubber 1.52; calcite, mean of both rays, 1.60.
// Absorption of water per metre at 610, 550 and 465 nm: 0.264, 0.0565, 0.0101 (Pope and Fry 1997).
// Colours of dielectrics, roughness, coats and tints of glass are chosen by eye.

namespace daylit {

namespace {

constexpr float kAbbe = 20.0f; // KHR_materials_dispersion: 20 / Abbe number

constexpr float kAcross = 0.5f * std::numbers::pi_v<float>; // brushed around: the highlight lies across the grooves

ObjectMaterial metal(const char* name, const Rgb& f0, float roughness, float anisotropy = 0.0f) {
  return {.name = name,
          .base_colour = f0,
          .metallic = 1.0f,
          .roughness = roughness,
          .anisotropy = anisotropy,
          .anisotropy_rotation = anisotropy > 0.0f ? kAcross : 0.0f};
}

ObjectMaterial opaque(const char* name, const Rgb& colour, float roughness, float ior = 1.5f) {
  return {.name = name, .base_colour = colour, .roughness = roughness, .ior = ior};
}

ObjectMaterial coated(const char* name, const Rgb& colour, float roughness, float coat, float coat_roughness) {
  ObjectMaterial m = opaque(name, colour, roughness);
  m.clearcoat = coat;
  m.clearcoat_roughness = coat_roughness;
  return m;
}

/// `left`: of light, after `distance_m` inside.
ObjectMaterial clear(const char* name, float ior, float roughness = 0.0f, const Rgb& left = Rgb(1.0f),
                     float distance_m = 0.0f, float dispersion = 0.0f) {
  return {.name = name,
          .base_colour = Rgb(1.0f),
          .roughness = roughness,
          .ior = ior,
          .transmission = 1.0f,
          .attenuation_colour = left,
          .attenuation_distance_m = distance_m,
          .dispersion = dispersion};
}

/// Sorted by name.
std::span<const ObjectMaterial> all() {
  static const Rgb aluminium(0.913f, 0.922f, 0.924f), iron(0.562f, 0.565f, 0.578f);
  static const ObjectMaterial list[] = {
      metal("aluminium", aluminium, 0.2f),
      metal("brass", {0.910f, 0.778f, 0.423f}, 0.15f),
      metal("brushed-aluminium", aluminium, 0.35f, 0.8f),
      metal("brushed-steel", iron, 0.35f, 0.8f),
      coated("car-paint", {0.35f, 0.02f, 0.02f}, 0.45f, 1.0f, 0.02f),
      metal("chrome", {0.549f, 0.556f, 0.554f}, 0.02f),
      metal("copper", {0.955f, 0.638f, 0.538f}, 0.15f),
      clear("crystal", 1.62f, 0.0f, Rgb(1.0f), 0.0f, kAbbe / 36.4f),
      clear("diamond", 2.417f, 0.0f, Rgb(1.0f), 0.0f, kAbbe / 55.3f),
      clear("frosted-glass", 1.52f, 0.4f),
      clear("glass", 1.52f),
      opaque("glossy-plastic-black", Rgb(0.02f), 0.15f),
      opaque("glossy-plastic-red", {0.55f, 0.03f, 0.03f}, 0.15f),
      opaque("glossy-plastic-white", Rgb(0.8f), 0.15f),
      metal("gold", {1.000f, 0.782f, 0.344f}, 0.1f),
      clear("green-glass", 1.52f, 0.0f, {0.2f, 0.65f, 0.3f}, 0.01f),
      metal("iron", iron, 0.4f),
      metal("mirror", {0.972f, 0.960f, 0.915f}, 0.0f), // silver behind glass
      coated("pearl", {0.78f, 0.72f, 0.66f}, 0.4f, 0.7f, 0.1f),
      opaque("plaster", Rgb(0.8f), 1.0f),
      opaque("polished-marble", {0.78f, 0.75f, 0.70f}, 0.1f, 1.60f),
      opaque("porcelain", {0.82f, 0.81f, 0.78f}, 0.08f),
      opaque("rubber", Rgb(0.04f), 0.8f, 1.52f),
      metal("silver", {0.972f, 0.960f, 0.915f}, 0.1f),
      metal("titanium", {0.542f, 0.497f, 0.449f}, 0.3f),
      coated("varnished-wood", {0.25f, 0.12f, 0.05f}, 0.6f, 1.0f, 0.05f),
      clear("water", 1.333f, 0.0f, {0.768f, 0.945f, 0.990f}, 1.0f),
  };
  return list;
}

} // namespace

std::vector<std::string> library_names() {
  std::vector<std::string> names;
  for (const ObjectMaterial& m : all())
    names.push_back(m.name);
  return names;
}

Result<ObjectMaterial> library_material(const std::string& name) {
  const auto found = std::ranges::find(all(), name, &ObjectMaterial::name);
  if (found == all().end())
    return Error{ErrorCode::not_found, "there is no material of that name", name,
                 fmt::format("one of: {}", fmt::join(library_names(), ", "))};
  return *found;
}

} // namespace daylit
