#include "runtime/object/virtual_objects.h"

#include <algorithm>
#include <cmath>
#include <span>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "runtime/object/cut_mesh.h"
#include "runtime/object/divide_mesh.h"
#include "runtime/object/mesh_topology.h"
#include "runtime/object/object_rays.h"
#include "runtime/object/relight.h"
#include "runtime/object/senders.h"
#include "runtime/object/simplify_mesh.h"
#include "scene/core/parallel.h"
#include "scene/model/glass_check.h"
#include "scene/model/mesh_edit.h"
#include "scene/model/surface_look.h"
#include "scene/placing/read_object.h"
#include "scene/placing/standing.h"

namespace daylit {

glm::mat3 VirtualObjects::Part::rotation() const {
  const glm::dmat3 linear(world_from_object);
  return glm::mat3(linear / std::cbrt(std::fabs(glm::determinant(linear))));
}

std::vector<VertexTransfer> VirtualObjects::world_transfer(std::size_t k,
                                                           std::span<const std::uint32_t> vertices) const {
  const Part& part = parts[k];
  std::vector<VertexTransfer> turned;
  turned.reserve(vertices.size());
  for (const std::uint32_t v : vertices)
    turned.push_back(part.model->transfer[v]);
  // Transfer vectors are integrals over directions: a uniform scale leaves them as they are.
  rotate_transfer(turned, part.rotation(), turned);
  return turned;
}

/// Of a part around its bounding box, not the vertices.
void VirtualObjects::find_bounds(std::size_t k) {
  Bounds box;
  for (std::size_t i = 0; i < parts[k].mesh().positions.size(); ++i)
    box.include(surface.positions[parts[k].first_vertex + i]);
  parts[k].sphere = box.empty() ? BoundingSphere{} : BoundingSphere{box.centre(), 0.5 * glm::length(box.size())};
  sphere = surface.bounds();
}

namespace {

/// What the part's senders are, as the surface has it.
void place_senders(std::size_t k, VirtualObjects& all) {
  VirtualObjects::Senders& senders = all.senders;
  const VirtualObjects::Part& part = all.parts[k];
  const auto from = std::ranges::lower_bound(senders.vertex, part.first_vertex),
             to = std::ranges::lower_bound(senders.vertex, part.first_vertex + part.mesh().positions.size());
  std::vector<std::uint32_t> own;
  for (auto v = from; v != to; ++v) {
    const auto s = static_cast<std::size_t>(v - senders.vertex.begin());
    senders.surface.positions[s] = all.surface.positions[*v];
    senders.surface.normals[s] = all.surface.normals[*v];
    senders.surface.reflectance[s] = all.surface.reflectance[*v];
    own.push_back(static_cast<std::uint32_t>(*v - part.first_vertex));
  }
  std::ranges::copy(all.world_transfer(k, own), senders.transfer.begin() + (from - senders.vertex.begin()));
}

} // namespace

Result<void> VirtualObjects::set_placement(std::size_t k, const ObjectConfig& placement) {
  const glm::dmat4 world_from_object = object_transform(placement);
  const glm::dmat3 linear(world_from_object);
  const double scale = std::cbrt(std::fabs(glm::determinant(linear)));
  if (k >= parts.size() || !std::isfinite(scale) || scale <= 0.0)
    return Error{ErrorCode::value_invalid, "object " + std::to_string(k) + " cannot be placed so", "[[object]]",
                 "give an object of the configuration a positive scale"};
  Part& part = parts[k];
  part.world_from_object = world_from_object;
  const glm::mat3 rotation = part.rotation();
  parallel_for(tbb::blocked_range<std::size_t>(0, part.mesh().positions.size(), 1024), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const std::size_t at = part.first_vertex + i;
      surface.positions[at] = glm::dvec3(world_from_object * glm::dvec4(glm::dvec3(part.mesh().positions[i]), 1.0));
      surface.normals[at] = glm::normalize(rotation * part.mesh().normals[i]);
      surface.reflectance[at] = part.mesh().reflectance[i];
      if (part.per_pixel)
        surface.reflectance[at] = glm::max(surface.reflectance[at], Rgb(kLeastReflectance));
      surface.drawn_reflectance[at] = part.per_pixel ? Rgb(part.has_diffuse[i]) : surface.reflectance[at];
    }
  });
  place_senders(k, *this);
  find_bounds(k);
  return {};
}

/// In the frame of each part, where distances along the ray are those of the world.
std::optional<std::size_t> VirtualObjects::first_hit(const glm::dvec3& eye, const glm::dvec3& direction,
                                                     double most_m) const {
  std::optional<std::size_t> first;
  auto nearest = static_cast<float>(most_m);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const glm::dmat4 object_from_world = glm::inverse(parts[k].world_from_object);
    RayHit hit;
    if (!parts[k].rays().closest(parts[k].rays().to_local(glm::dvec3(object_from_world * glm::dvec4(eye, 1.0))),
                                 glm::vec3(glm::dmat3(object_from_world) * direction), 0.0f, nearest, hit))
      continue;
    first = k;
    nearest = hit.distance;
  }
  return first;
}

namespace {

/// It mirrors, or its colour varies between vertices.
bool looked_up_per_pixel(const ObjectMesh& mesh) {
  return std::ranges::any_of(mesh.materials, [](const ObjectMaterial& m) {
    return m.is_glossy() || m.base_colour_texture || m.normal_texture || m.occlusion_texture || m.emission != Rgb(0.0f);
  });
}

/// Per vertex: some triangle around it has a material of which a part is diffuse.
std::vector<std::uint8_t> diffuse_vertices(const ObjectMesh& mesh) {
  std::vector<std::uint8_t> found(mesh.positions.size(), 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const ObjectMaterial* m = mesh.material_or_null(t);
    if (!m || m->has_diffuse())
      for (const std::uint32_t v : mesh.triangles[t])
        found[v] = 1;
  }
  return found;
}

/// Each once that joins different senders.
void append_triangles(const ObjectMesh& mesh, std::span<const std::uint32_t> sender, std::size_t senders,
                      std::vector<std::array<std::uint32_t, 3>>& triangles) {
  const auto first = static_cast<std::ptrdiff_t>(triangles.size());
  for (const auto& t : mesh.triangles)
    if (sender[t[0]] != sender[t[1]] || sender[t[1]] != sender[t[2]])
      triangles.push_back({sender[t[0]], sender[t[1]], sender[t[2]]});
  if (mesh.positions.size() == senders)
    return;
  std::sort(triangles.begin() + first, triangles.end());
  triangles.erase(std::unique(triangles.begin() + first, triangles.end()), triangles.end());
}

/// Numbers those of a part after the ones before.
std::vector<std::uint32_t> append_senders(const VirtualObjects::Model& model, std::size_t first_vertex,
                                          VirtualObjects::Senders& senders) {
  const auto before = static_cast<std::uint32_t>(senders.vertex.size());
  std::vector<std::uint32_t> number = model.senders.of;
  for (std::uint32_t& n : number)
    n += before;
  for (const std::uint32_t v : model.senders.vertex)
    senders.vertex.push_back(static_cast<std::uint32_t>(first_vertex + v));
  const std::size_t count = senders.vertex.size();
  senders.surface.positions.resize(count);
  senders.surface.normals.resize(count);
  senders.surface.reflectance.resize(count);
  senders.transfer.resize(count);
  append_triangles(model.mesh, number, count - before, senders.surface.triangles);
  return number;
}

/// A model stays in its own frame; the surface of all objects is in the world.
Result<void> append(VirtualObjects& all, std::shared_ptr<const VirtualObjects::Model> model, const MeshWeight& weight,
                    const ObjectConfig& placement) {
  const ObjectMesh& mesh = model->mesh;
  const std::size_t first = all.surface.positions.size(), count = first + mesh.positions.size();
  all.surface.positions.resize(count);
  all.surface.normals.resize(count);
  all.surface.reflectance.resize(count);
  all.surface.drawn_reflectance.resize(count);
  const auto offset = static_cast<std::uint32_t>(first);
  for (const auto& t : mesh.triangles)
    all.surface.triangles.push_back({offset + t[0], offset + t[1], offset + t[2]});
  for (const VertexTransfer& t : model->transfer)
    all.has_back.push_back(t.back != TransferVector{});
  const bool per_pixel = looked_up_per_pixel(mesh);
  const std::vector<Rgb> diffuse_part = per_pixel ? diffuse_reflectance(mesh) : mesh.reflectance;
  for (const std::uint32_t v : model->senders.vertex)
    all.senders.diffuse_reflectance.push_back(diffuse_part[v]);
  auto diffuse = per_pixel ? diffuse_vertices(mesh) : std::vector<std::uint8_t>{};
  auto sender = append_senders(*model, first, all.senders);
  all.parts.push_back(
      {std::move(model), first, std::move(sender), glm::dmat4(1.0), weight, per_pixel, std::move(diffuse)});
  return all.set_placement(all.parts.size() - 1, placement);
}

/// Per vertex, the mean over the triangles around it by their area.
std::vector<Rgb> vertex_emission(const ObjectMesh& mesh) {
  std::vector<Rgb> sum(mesh.positions.size(), Rgb(0.0f));
  std::vector<float> area(mesh.positions.size(), 0.0f);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const float size =
        0.5f * glm::length(glm::cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]));
    const Rgb emission = surface_look(mesh, t, 1.0f / 3.0f, 1.0f / 3.0f, std::sqrt(size)).material.emission;
    for (const std::uint32_t v : mesh.triangles[t]) {
      sum[v] += size * emission;
      area[v] += size;
    }
  }
  for (std::size_t i = 0; i < sum.size(); ++i)
    sum[i] /= std::max(area[i], 1e-30f);
  return sum;
}

void find_emission(VirtualObjects& all) {
  for (const VirtualObjects::Part& part : all.parts) {
    if (std::ranges::none_of(part.mesh().materials, [](const ObjectMaterial& m) { return m.emission != Rgb(0.0f); }))
      continue;
    const std::vector<Rgb> emission = vertex_emission(part.mesh());
    all.senders.surface.emission.resize(all.senders.vertex.size(), Rgb(0.0f));
    for (std::uint32_t v = 0; v < emission.size(); ++v)
      if (all.senders.vertex[part.sender[v]] == part.first_vertex + v)
        all.senders.surface.emission[part.sender[v]] = emission[v];
  }
}

void find_metals(VirtualObjects& all) {
  const auto is_metal = [](const ObjectMaterial& m) { return mean_mirrored_reflectance(m) != Rgb(0.0f); };
  for (VirtualObjects::Part& part : all.parts) {
    part.is_metal = std::ranges::any_of(part.mesh().materials, is_metal);
    if (!part.is_metal)
      continue;
    all.senders.mirrored_reflectance.resize(all.senders.vertex.size(), Rgb(0.0f));
    const std::vector<Rgb> mirrored = mirrored_reflectance(part.mesh());
    for (std::uint32_t v = 0; v < mirrored.size(); ++v)
      if (all.senders.vertex[part.sender[v]] == part.first_vertex + v)
        all.senders.mirrored_reflectance[part.sender[v]] = mirrored[v];
  }
}

void find_glass(VirtualObjects& all) {
  const auto is_glass = [](const ObjectMaterial& m) { return m.is_transparent(); };
  const ObjectRays rays(all);
  std::uint32_t first_triangle = 0;
  for (std::size_t k = 0; k < all.parts.size(); ++k) {
    VirtualObjects::Part& part = all.parts[k];
    if (std::ranges::any_of(part.mesh().materials, is_glass)) {
      part.has_glass = true;
      part.transmittance = rays.mean_transmittance(k);
      all.surface.glass.push_back({std::shared_ptr<const ObjectMesh>(part.model, &part.mesh()), first_triangle});
    }
    first_triangle += static_cast<std::uint32_t>(part.mesh().triangles.size());
  }
}

bool mirrors_all_over(const ObjectMesh& mesh) {
  return looked_up_per_pixel(mesh) &&
         std::ranges::none_of(diffuse_vertices(mesh), [](std::uint8_t some) { return some != 0; });
}

/// The vertical in its own frame.
glm::vec3 up_of(const ObjectConfig& placement) {
  return glm::vec3(glm::normalize(glm::transpose(glm::dmat3(object_transform(placement))) * glm::dvec3(0.0, 0.0, 1.0)));
}

/// Read, divided and cut, with its transfer vectors.
struct LoadedModel {
  std::shared_ptr<const VirtualObjects::Model> model;
  MeshWeight weight;
};

Result<LoadedModel> load_model(const ObjectConfig& object, const std::filesystem::path& cache_folder,
                               std::vector<std::string>& notes, const Progress& progress) {
  auto mesh = read_object(object, &notes);
  if (!mesh)
    return mesh.error();
  if (mesh->triangles.empty())
    notes.push_back(object.model.string() + ": no triangles, nothing is drawn");
  for (std::string& line : glass_notes(*mesh, object.model.string()))
    notes.push_back(std::move(line));
  const MeshWeight weight = weigh(*mesh);
  if (const auto simpler = simplify_dense(*mesh); !simpler)
    return simpler.error();
  const TransferSettings settings{.closed = is_closed(*mesh)}; // the cuts open it, but only where nobody looks
  divide_coarse_mesh(*mesh);
  if (const auto cut = cut_where_parts_cross(*mesh); !cut)
    return cut.error();
  auto transfer = cached_transfer(*mesh, cache_folder, object.model.stem().string(), settings, progress);
  if (!transfer)
    return transfer.error();
  if (!transfer->note.empty())
    notes.push_back(transfer->note);
  auto rays = RayScene::build(std::vector<glm::dvec3>(mesh->positions.begin(), mesh->positions.end()), mesh->triangles);
  if (!rays)
    return rays.error();
  MeshSenders senders = find_senders(*mesh, up_of(object), mirrors_all_over(*mesh) ? kMostMirrorSenders : kMostSenders);
  auto self = SelfExchange::make(*mesh, *rays, senders, settings.closed, progress);
  if (!self)
    return self.error();
  VirtualObjects::Model model{std::move(*mesh), std::move(transfer->transfer), std::move(*rays), std::move(senders),
                              std::move(*self)};
  return LoadedModel{std::make_shared<const VirtualObjects::Model>(std::move(model)), weight};
}

bool same_model(const ObjectConfig& a, const ObjectConfig& b) {
  return a.model == b.model && a.material == b.material && a.reflectance == b.reflectance;
}

} // namespace

Result<VirtualObjects> load_virtual_objects(const std::vector<ObjectConfig>& objects,
                                            const std::filesystem::path& cache_folder, const Progress& progress) {
  VirtualObjects all;
  for (std::size_t k = 0; k < objects.size(); ++k) {
    if (!progress("objects", static_cast<double>(k) / static_cast<double>(objects.size())))
      return interrupted_error("loading objects");
    std::size_t first = 0; // of the same model
    while (!same_model(objects[first], objects[k]))
      ++first;
    const auto loaded = first < k ? Result<LoadedModel>{LoadedModel{all.parts[first].model, all.parts[first].weight}}
                                  : load_model(objects[k], cache_folder, all.notes, progress);
    if (!loaded)
      return loaded.error();
    if (const auto placed = append(all, loaded->model, loaded->weight, objects[k]); !placed)
      return placed.error();
  }
  find_emission(all);
  find_metals(all);
  find_glass(all);
  return all;
}

} // namespace daylit
