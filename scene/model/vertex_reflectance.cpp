#include <cmath>

#include <glm/geometric.hpp>

#include "scene/model/mesh_edit.h"
#include "scene/model/texture_lookup.h"

namespace daylit {

namespace {

double triangle_area(const ObjectMesh& mesh, std::size_t triangle) {
  const auto& t = mesh.triangles[triangle];
  const glm::dvec3 p(mesh.positions[t[0]]);
  return 0.5 * glm::length(glm::cross(glm::dvec3(mesh.positions[t[1]]) - p, glm::dvec3(mesh.positions[t[2]]) - p));
}

/// The material of a triangle with its textures averaged over it: the triangle is half of a parallelogram.
ObjectMaterial mean_material(const ObjectMesh& mesh, std::size_t triangle, double area) {
  ObjectMaterial m = mesh.materials[mesh.triangle_material.empty() ? 0 : mesh.triangle_material[triangle]];
  if (mesh.uv.empty())
    return m;
  constexpr float third = 1.0f / 3.0f;
  const detail::TextureLookup textures(mesh, triangle, third, third, static_cast<float>(std::sqrt(2.0 * area)));
  const Rgb metallic_roughness = textures.at(m.metallic_roughness_texture);
  m.base_colour *= textures.at(m.base_colour_texture);
  m.roughness *= metallic_roughness.g;
  m.metallic *= metallic_roughness.b;
  m.transmission *= textures.at(m.transmission_texture).r;
  m.clearcoat *= textures.at(m.clearcoat_texture).r;
  if (m.lobe) {
    m.lobe->weight *= textures.at(m.lobe_weight_texture);
    m.lobe->exponent = std::pow(m.lobe->exponent, textures.at(m.lobe_exponent_texture).r);
  }
  return m;
}

/// Of each vertex, the mean of a reflectance over the triangles around by their area.
std::vector<Rgb> at_vertices(const ObjectMesh& mesh, Rgb (*reflectance)(const ObjectMaterial&)) {
  std::vector<double> weight(mesh.positions.size(), 0.0);
  std::vector<glm::dvec3> sum(mesh.positions.size(), glm::dvec3(0.0));
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
    const double area = triangle_area(mesh, k);
    ObjectMaterial m = mean_material(mesh, k, area);
    const Rgb base = m.base_colour;
    for (const std::uint32_t v : mesh.triangles[k]) {
      m.base_colour = mesh.colours.empty() ? base : base * mesh.colours[v];
      sum[v] += area * glm::dvec3(reflectance(m));
      weight[v] += area;
    }
  }
  std::vector<Rgb> mean(mesh.positions.size(), Rgb(0.0f));
  for (std::size_t v = 0; v < sum.size(); ++v)
    if (weight[v] > 0.0)
      mean[v] = Rgb(sum[v] / weight[v]);
  return mean;
}

} // namespace

void set_reflectance(ObjectMesh& mesh) { mesh.reflectance = at_vertices(mesh, mean_reflectance); }

std::vector<Rgb> diffuse_reflectance(const ObjectMesh& mesh) {
  return mesh.materials.empty() ? mesh.reflectance : at_vertices(mesh, mean_diffuse_reflectance);
}

std::vector<Rgb> mirrored_reflectance(const ObjectMesh& mesh) { return at_vertices(mesh, mean_mirrored_reflectance); }

} // namespace daylit
