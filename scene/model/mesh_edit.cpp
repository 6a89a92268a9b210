#include "scene/model/mesh_edit.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

namespace daylit {

namespace {

constexpr std::size_t kMostMaterials = 65535;

/// What only some meshes have: `count` values, `fill` where the mesh had none.
template <class Value>
void extend(std::vector<Value>& all, std::size_t before, std::vector<Value> more, std::size_t count,
            const Value& fill) {
  if (all.empty() && more.empty())
    return;
  all.resize(before, fill);
  more.resize(count, fill);
  all.insert(all.end(), more.begin(), more.end());
}

/// A mesh without materials is diffuse, of its vertices' reflectance.
void name_material(ObjectMesh& mesh) {
  if (!mesh.materials.empty() || mesh.triangles.empty())
    return;
  mesh.materials.push_back({.base_colour = Rgb(1.0f)});
  mesh.colours = mesh.reflectance;
}

void shift_textures(ObjectMaterial& m, std::int32_t by) {
  for (TextureUse* use : m.texture_uses())
    if (*use)
      use->texture += by;
}

/// Materials, textures, and which triangle has which.
void append_materials(ObjectMesh& all, ObjectMesh& part) {
  for (ObjectMaterial& m : part.materials)
    shift_textures(m, static_cast<std::int32_t>(all.textures.size()));
  const auto first = static_cast<std::uint16_t>(all.materials.size());
  part.triangle_material.resize(part.triangles.size(), 0);
  for (std::uint16_t& m : part.triangle_material)
    m = static_cast<std::uint16_t>(m + first);
  if (first > 0) {
    all.triangle_material.resize(all.triangles.size(), 0);
    all.triangle_material.insert(all.triangle_material.end(), part.triangle_material.begin(),
                                 part.triangle_material.end());
  } else {
    all.triangle_material = std::move(part.triangle_material);
  }
  std::ranges::move(part.materials, std::back_inserter(all.materials));
  std::ranges::move(part.textures, std::back_inserter(all.textures));
}

} // namespace

std::uint32_t add_between(ObjectMesh& mesh, std::uint32_t a, std::uint32_t b, float t) {
  const auto at = [&](auto& of) {
    if (!of.empty())
      of.push_back(glm::mix(of[a], of[b], t));
  };
  const auto vertex = static_cast<std::uint32_t>(mesh.positions.size());
  const glm::vec3 n = glm::mix(mesh.normals[a], mesh.normals[b], t);
  mesh.normals.push_back(glm::dot(n, n) > 1e-12f ? glm::normalize(n) : glm::vec3(mesh.normals[a]));
  at(mesh.positions);
  at(mesh.reflectance);
  at(mesh.colours);
  at(mesh.uv);
  if (!mesh.tangents.empty()) {
    glm::vec4 tangent = glm::mix(mesh.tangents[a], mesh.tangents[b], t);
    const float length = glm::length(glm::vec3(tangent));
    tangent = length > 1e-6f ? tangent / length : mesh.tangents[a];
    tangent.w = mesh.tangents[a].w;
    mesh.tangents.push_back(tangent);
  }
  return vertex;
}

void drop_unused_vertices(ObjectMesh& mesh) {
  constexpr std::uint32_t kUnused = 0xFFFFFFFFu;
  std::vector<std::uint32_t> number(mesh.positions.size(), kUnused);
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t v : t)
      number[v] = 0;
  std::uint32_t used = 0;
  for (std::uint32_t& n : number)
    if (n != kUnused)
      n = used++;
  const auto keep = [&](auto& of) {
    if (of.empty())
      return;
    for (std::size_t v = 0; v < number.size(); ++v)
      if (number[v] != kUnused)
        of[number[v]] = of[v];
    of.resize(used);
  };
  keep(mesh.positions);
  keep(mesh.normals);
  keep(mesh.reflectance);
  keep(mesh.colours);
  keep(mesh.uv);
  keep(mesh.tangents);
  for (auto& t : mesh.triangles)
    for (std::uint32_t& v : t)
      v = number[v];
}

void give_material(ObjectMesh& mesh, ObjectMaterial material) {
  mesh.materials.assign(1, std::move(material));
  mesh.triangle_material.clear();
  mesh.textures.clear();
  mesh.colours.clear();
  set_tangents(mesh);
  mesh.uv.clear();
  set_reflectance(mesh);
}

Result<void> append_mesh(ObjectMesh& all, ObjectMesh part, const glm::dmat4& all_from_part) {
  if (all.materials.size() + part.materials.size() > kMostMaterials)
    return Error{ErrorCode::limit_exceeded, "more than 65,535 materials in all objects together", "[[object]]",
                 "simplify the objects"};
  name_material(all);
  name_material(part);
  const glm::dmat3 linear(all_from_part), normal_matrix = glm::transpose(glm::inverse(linear));
  const std::size_t before = all.positions.size(), count = part.positions.size();
  append_materials(all, part);
  for (const glm::vec3& p : part.positions)
    all.positions.emplace_back(all_from_part * glm::dvec4(glm::dvec3(p), 1.0));
  for (const glm::vec3& n : part.normals)
    all.normals.emplace_back(glm::normalize(normal_matrix * glm::dvec3(n)));
  for (glm::vec4& t : part.tangents)
    t = glm::vec4(glm::vec3(glm::normalize(linear * glm::dvec3(t))), t.w);
  extend(all.reflectance, before, std::move(part.reflectance), count, Rgb(0.0f));
  extend(all.colours, before, std::move(part.colours), count, Rgb(1.0f));
  extend(all.uv, before, std::move(part.uv), count, glm::vec2(0.0f));
  extend(all.tangents, before, std::move(part.tangents), count, glm::vec4(0.0f));
  const auto offset = static_cast<std::uint32_t>(before);
  for (const auto& t : part.triangles)
    all.triangles.push_back({offset + t[0], offset + t[1], offset + t[2]});
  return {};
}

void wind_by_normals(ObjectMesh& mesh) {
  for (auto& t : mesh.triangles) {
    const glm::vec3 facet =
        glm::cross(mesh.positions[t[1]] - mesh.positions[t[0]], mesh.positions[t[2]] - mesh.positions[t[0]]);
    if (glm::dot(facet, mesh.normals[t[0]] + mesh.normals[t[1]] + mesh.normals[t[2]]) < 0.0f)
      std::swap(t[1], t[2]);
  }
}

} // namespace daylit
