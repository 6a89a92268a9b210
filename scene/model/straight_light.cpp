#include "scene/model/straight_light.h"

#include <cmath>

#include <glm/exponential.hpp>

#include "scene/material/fresnel.h"
#include "scene/model/surface_look.h"
#include "scene/model/texture_lookup.h"

namespace daylit {

Rgb straight_colour(const ObjectMesh& mesh, std::size_t triangle, float u, float v) {
  const ObjectMaterial* m = mesh.material_or_null(triangle);
  if (!m || !m->is_transparent())
    return Rgb(0.0f);
  const detail::TextureLookup textures(mesh, triangle, u, v, 0.0f);
  return (1.0f - m->metallic * textures.at(m->metallic_roughness_texture).b) * m->transmission *
         textures.at(m->transmission_texture).r * base_colour(mesh, triangle, u, v, 0.0f);
}

bool has_even_colour(const ObjectMesh& mesh, std::size_t triangle) {
  const ObjectMaterial* m = mesh.material_or_null(triangle);
  return !m || (mesh.colours.empty() && !m->metallic_roughness_texture && !m->transmission_texture &&
                !m->base_colour_texture);
}

/// (1 - metallic) transmission (1 - F) colour, F as seen from outside on both sides: the way does not bend. Behind the
/// far face of solid glass times exp(-a d) (Beer 1852).
Rgb straight_transmittance(const ObjectMesh& mesh, std::size_t triangle, float u, float v, float cosine, float way_m) {
  const ObjectMaterial* m = mesh.material_or_null(triangle);
  if (!m || !m->is_transparent())
    return Rgb(0.0f);
  const Rgb left = (1.0f - fresnel_dielectric(std::abs(cosine), m->ior)) * straight_colour(mesh, triangle, u, v);
  return cosine > 0.0f && !m->thin ? left * glm::exp(-m->absorption_per_m() * way_m) : left;
}

} // namespace daylit
