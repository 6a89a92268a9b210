#pragma once

// What a surface does with light: one description for the renderers and for the path tracer. Parameters are those of
// glTF 2.0 (Khronos 2021, section 3.9 and appendix B) and of its extensions KHR_materials_ior, _transmission, _volume,
// _dispersion, _clearcoat, _anisotropy and _emissive_strength.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/material/lafortune.h"
#include "scene/material/texture.h"

namespace daylit {

/// A texture as a material uses it.
struct TextureUse {
  std::int32_t texture = -1;    ///< of the mesh's textures; -1: none
  glm::mat3 uv_from_mesh{1.0f}; ///< KHR_texture_transform
  explicit operator bool() const { return texture >= 0; }
  bool operator==(const TextureUse&) const = default;
};

struct ObjectMaterial {
  std::string name{};
  Rgb base_colour{0.7f};        ///< reflectance of the diffuse part, or reflectance of a metal seen face on
  float metallic = 0.0f;        ///< 0: dielectric, 1: metal
  float roughness = 1.0f;       ///< perceptual, 0..1: the microfacets' slope is its square
  float ior = 1.5f;             ///< refractive index of the dielectric, at least 1
  float transmission = 0.0f;    ///< of the light that a dielectric does not mirror, what goes through instead of being
                                ///< reflected diffusely
  Rgb attenuation_colour{1.0f}; ///< what is left of light after attenuation_distance_m inside the object
  float attenuation_distance_m = 0.0f; ///< 0: nothing is lost
  bool thin = false;       ///< no volume behind the surface: light goes straight through, both sides count once
  float dispersion = 0.0f; ///< 20 / Abbe number; 0: none
  float clearcoat = 0.0f, clearcoat_roughness = 0.0f;  ///< a layer of index 1.5 on top
  float anisotropy = 0.0f, anisotropy_rotation = 0.0f; ///< 0..1; radians, counter-clockwise from the tangent
  Rgb emission{0.0f}; ///< radiance it sends by itself, W/(m^2 sr), or what the sky is measured in
  float normal_scale = 1.0f, occlusion_strength = 1.0f;
  /// In the place of all that mirrors or lets through; base_colour is what it leaves, diffuse.
  std::optional<LafortuneLobe> lobe{};
  float lobe_rotation = 0.0f; ///< radians, of the lobe's frame, counter-clockwise from the tangent

  TextureUse base_colour_texture{}, metallic_roughness_texture{}, normal_texture{}, occlusion_texture{},
      emission_texture{}, transmission_texture{}, clearcoat_texture{}, clearcoat_roughness_texture{},
      anisotropy_texture{}, lobe_weight_texture{}, lobe_exponent_texture{}, lobe_rotation_texture{};

  std::array<TextureUse*, 12> texture_uses() {
    return {&base_colour_texture, &metallic_roughness_texture, &normal_texture,        &occlusion_texture,
            &emission_texture,    &transmission_texture,       &clearcoat_texture,     &clearcoat_roughness_texture,
            &anisotropy_texture,  &lobe_weight_texture,        &lobe_exponent_texture, &lobe_rotation_texture};
  }

  /// Roughness from which a dielectric without coat and transmission counts as a diffuse surface of its base colour:
  /// nothing of the room can be seen in it.
  static constexpr float kDiffuseRoughness = 0.95f;
  /// It mirrors, refracts or has a gloss: diffuse materials cost no ray.
  bool is_glossy() const {
    return lobe || metallic > 0.0f || transmission > 0.0f || clearcoat > 0.0f || roughness < kDiffuseRoughness ||
           static_cast<bool>(metallic_roughness_texture) || static_cast<bool>(clearcoat_texture);
  }
  /// -ln(colour) / distance.
  Rgb absorption_per_m() const {
    return attenuation_distance_m > 0.0f ? -glm::log(glm::max(attenuation_colour, Rgb(1e-6f))) / attenuation_distance_m
                                         : Rgb(0.0f);
  }
  bool is_transparent() const { return transmission > 0.0f; }
  /// Some of it is diffuse: neither metal all over, nor clear all over.
  bool has_diffuse() const {
    return (metallic < 1.0f || metallic_roughness_texture) && (transmission < 1.0f || transmission_texture);
  }
  /// It is drawn with directions along the surface.
  bool needs_tangents() const {
    return static_cast<bool>(normal_texture) || anisotropy > 0.0f || (lobe && lobe->c.x != lobe->c.y);
  }
  bool operator==(const ObjectMaterial&) const = default;
};

/// A material at one point of a surface, textures looked up. Diffuse materials have no interface: index 1.
struct SurfaceMaterial {
  Rgb base_colour{0.7f};
  float metallic = 0.0f;
  float alpha_u = 1.0f, alpha_v = 1.0f; ///< GGX slopes along tangent and bitangent (roughness squared, anisotropy)
  float ior = 1.5f;
  float transmission = 0.0f;
  Rgb absorption_per_m{0.0f}; ///< inside: exp(-absorption x distance)
  bool thin = false;
  float dispersion = 0.0f;
  float clearcoat = 0.0f, clearcoat_alpha = 0.0f;
  Rgb emission{0.0f};
  float occlusion = 1.0f;              ///< what is left of the indirect light in hollows that the mesh does not have
  std::optional<LafortuneLobe> lobe{}; ///< then only base_colour, emission and occlusion count of the rest

  /// It bends colours apart.
  bool disperses() const { return dispersion > 0.0f && transmission > 0.0f && !thin; }
  /// Index of red, green or blue light (KHR_materials_dispersion: half spread 0.025 dispersion (n - 1)).
  float ior_of(int channel) const {
    return disperses() ? ior + static_cast<float>(channel - 1) * 0.025f * dispersion * (ior - 1.0f) : ior;
  }
  bool operator==(const SurfaceMaterial&) const = default;
};

/// Error value_invalid: a number that is NaN, or outside the range that its description gives. `where` stands in it.
Result<void> check_material(const ObjectMaterial& material, const std::string& where);

/// Part of diffuse light that the surface sends back, both sides of a pane together: the base colour of a diffuse
/// material; else the mean Fresnel reflectance of the interfaces, and of the base what gets through them.
Rgb mean_reflectance(const ObjectMaterial& material);
/// The part of it that is diffuse: what the base sends back of light that gets through the interfaces.
Rgb mean_diffuse_reflectance(const ObjectMaterial& material);

/// The part of it that a metal mirrors: 1 - alpha, the larger of the slopes; the rest goes to all sides.
Rgb mean_mirrored_reflectance(const ObjectMaterial& material);

/// Slope of the smoothest surface that is told from a rougher one: below, a mirror is drawn with it.
constexpr float kLeastAlpha = 1e-4f;

} // namespace daylit
