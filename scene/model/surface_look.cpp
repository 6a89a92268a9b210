#include "scene/model/surface_look.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/model/texture_lookup.h"

namespace daylit {

namespace {

using detail::TextureLookup;

/// Linear between the corners.
template <class Value>
Value between(const std::vector<Value>& of, const std::array<std::uint32_t, 3>& t, float u, float v) {
  return (1.0f - u - v) * of[t[0]] + u * of[t[1]] + v * of[t[2]];
}

Rgb vertex_colour(const ObjectMesh& mesh, std::size_t triangle, float u, float v) {
  const auto& colours = mesh.materials.empty() ? mesh.reflectance : mesh.colours;
  return colours.empty() ? Rgb(1.0f) : between(colours, mesh.triangles[triangle], u, v);
}

/// A mesh without materials is diffuse.
const ObjectMaterial& material_of(const ObjectMesh& mesh, std::size_t triangle) {
  static const ObjectMaterial diffuse{.base_colour = Rgb(1.0f)};
  const ObjectMaterial* m = mesh.material_or_null(triangle);
  return m ? *m : diffuse;
}

/// Normal and tangent of the smooth surface, and which side the bitangent is on.
struct Frame {
  glm::vec3 normal, tangent;
  float sign = 1.0f;
};

/// What is left of `direction` across the normal.
glm::vec3 across(const glm::vec3& direction, const glm::vec3& normal) {
  const glm::vec3 t = direction - glm::dot(direction, normal) * normal;
  const float length = glm::length(t);
  return length > 1e-6f ? t / length : around_axis(normal);
}

Frame smooth_frame(const ObjectMesh& mesh, std::size_t triangle, float u, float v) {
  const auto& t = mesh.triangles[triangle];
  const glm::vec3 n = between(mesh.normals, t, u, v);
  const float length = glm::length(n);
  Frame frame{length > 1e-6f ? n / length : mesh.normals[t[0]], {}, 1.0f};
  if (mesh.tangents.empty()) {
    frame.tangent = around_axis(frame.normal);
    return frame;
  }
  frame.tangent = across(glm::vec3(between(mesh.tangents, t, u, v)), frame.normal);
  frame.sign = mesh.tangents[t[0]].w;
  return frame;
}

/// glTF 2.0, section 3.9.3: values of the map are 2 x - 1, those along the surface times the scale.
glm::vec3 mapped_normal(const ObjectMaterial& m, const TextureLookup& textures, const Frame& frame) {
  if (!m.normal_texture)
    return frame.normal;
  const glm::vec3 d = 2.0f * textures.at(m.normal_texture) - 1.0f;
  const glm::vec3 bitangent = frame.sign * glm::cross(frame.normal, frame.tangent);
  const glm::vec3 n = m.normal_scale * (d.x * frame.tangent + d.y * bitangent) + std::max(d.z, 1e-3f) * frame.normal;
  return glm::normalize(n);
}

/// Turns the tangent within the surface; `direction`: unit, along tangent and bitangent.
void turn_tangent(const glm::vec2& direction, const Frame& frame, SurfaceLook& look) {
  const glm::vec3 bitangent = frame.sign * glm::cross(look.normal, look.tangent);
  look.tangent = across(direction.x * look.tangent + direction.y * bitangent, look.normal);
}

/// Pessoa et al. 2012, section 4.2: the map holds an angle, white a full turn.
void turn_lobe(const ObjectMaterial& m, const TextureLookup& textures, const Frame& frame, SurfaceLook& look) {
  const float turn = m.lobe_rotation_texture ? textures.at(m.lobe_rotation_texture).r : 0.0f;
  const float angle = m.lobe_rotation + 2.0f * std::numbers::pi_v<float> * turn;
  if (angle != 0.0f)
    turn_tangent({std::cos(angle), std::sin(angle)}, frame, look);
}

/// KHR_materials_anisotropy: the map holds a direction in the tangent plane and a strength; both directions are turned
/// by the rotation. alpha_u = mix(alpha, 1, strength^2) along the direction, alpha across it.
void apply_anisotropy(const ObjectMaterial& m, const TextureLookup& textures, const Frame& frame, SurfaceLook& look) {
  if (m.anisotropy <= 0.0f)
    return;
  glm::vec2 direction(1.0f, 0.0f);
  float strength = m.anisotropy;
  if (m.anisotropy_texture) {
    const Rgb texel = textures.at(m.anisotropy_texture);
    const glm::vec2 d(2.0f * texel.r - 1.0f, 2.0f * texel.g - 1.0f);
    strength *= texel.b;
    if (glm::length(d) > 1e-3f)
      direction = glm::normalize(d);
  }
  const float c = std::cos(m.anisotropy_rotation), s = std::sin(m.anisotropy_rotation);
  turn_tangent({c * direction.x - s * direction.y, s * direction.x + c * direction.y}, frame, look);
  look.material.alpha_u = glm::mix(look.material.alpha_v, 1.0f, strength * strength);
}

float slope(float roughness) { return std::max(roughness * roughness, kLeastAlpha); }

/// glTF 2.0, section 3.9, and its extensions: which channel holds what.
SurfaceMaterial textured(const ObjectMaterial& m, const TextureLookup& textures, const Rgb& colour) {
  const Rgb metallic_roughness = textures.at(m.metallic_roughness_texture);
  SurfaceMaterial at;
  at.base_colour = m.base_colour * textures.at(m.base_colour_texture) * colour;
  at.metallic = m.metallic * metallic_roughness.b;
  at.alpha_u = at.alpha_v = slope(m.roughness * metallic_roughness.g);
  at.ior = m.is_glossy() ? m.ior : 1.0f;
  at.transmission = m.transmission * textures.at(m.transmission_texture).r;
  at.absorption_per_m = m.absorption_per_m();
  at.thin = m.thin;
  at.dispersion = m.dispersion;
  at.clearcoat = m.clearcoat * textures.at(m.clearcoat_texture).r;
  at.clearcoat_alpha = slope(m.clearcoat_roughness * textures.at(m.clearcoat_roughness_texture).g);
  at.emission = m.emission * textures.at(m.emission_texture);
  at.occlusion = 1.0f + m.occlusion_strength * (textures.at(m.occlusion_texture).r - 1.0f);
  if (m.lobe) {
    at.lobe = m.lobe;
    at.lobe->weight *= textures.at(m.lobe_weight_texture);
    at.lobe->exponent = std::pow(m.lobe->exponent, textures.at(m.lobe_exponent_texture).r);
    at.alpha_u = at.alpha_v = at.lobe->alpha();
  }
  return at;
}

} // namespace

glm::vec3 around_axis(const glm::vec3& normal) {
  const glm::vec2 d(-normal.y, normal.x);
  const float length = glm::length(d);
  return length > 1e-4f ? glm::vec3(d / length, 0.0f)
                        : glm::normalize(glm::vec3(1.0f, 0.0f, -normal.x / normal.z)); // along the axis: x
}

SurfaceLook surface_look(const ObjectMesh& mesh, std::size_t triangle, float u, float v, float footprint_m) {
  const ObjectMaterial& m = material_of(mesh, triangle);
  const TextureLookup textures(mesh, triangle, u, v, footprint_m);
  const Frame frame = smooth_frame(mesh, triangle, u, v);
  SurfaceLook look{
      textured(m, textures, vertex_colour(mesh, triangle, u, v)), mapped_normal(m, textures, frame), {}, frame.normal};
  look.tangent = across(frame.tangent, look.normal);
  apply_anisotropy(m, textures, frame, look);
  if (m.lobe)
    turn_lobe(m, textures, frame, look);
  return look;
}

Rgb base_colour(const ObjectMesh& mesh, std::size_t triangle, float u, float v, float footprint_m) {
  const ObjectMaterial& m = material_of(mesh, triangle);
  return m.base_colour * TextureLookup(mesh, triangle, u, v, footprint_m).at(m.base_colour_texture) *
         vertex_colour(mesh, triangle, u, v);
}

} // namespace daylit
