#include "runtime/object/virtual_objects.h"

#include <cmath>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "runtime/light/relight.h"

namespace daylit {

namespace {

void append(VirtualObjects& all, const ObjectMesh& mesh, const std::vector<VertexTransfer>& transfer,
            const ObjectConfig& config) {
  const glm::dmat4 world_from_object = object_transform(config);
  const glm::dmat3 linear(world_from_object);
  const double scale = std::cbrt(std::fabs(glm::determinant(linear)));
  const glm::mat3 rotation(scale > 0.0 ? linear / scale : glm::dmat3(1.0));
  const auto first = static_cast<std::uint32_t>(all.surface.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    all.surface.positions.emplace_back(world_from_object * glm::dvec4(glm::dvec3(mesh.positions[i]), 1.0));
    all.surface.normals.push_back(glm::normalize(rotation * mesh.normals[i]));
    all.surface.reflectance.push_back(config.reflectance ? *config.reflectance : mesh.reflectance[i]);
  }
  for (const auto& t : mesh.triangles)
    all.surface.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  // Transfer vectors are integrals over directions: a uniform scale leaves them as they are.
  const auto turned = rotate_transfer(transfer, rotation);
  all.transfer.insert(all.transfer.end(), turned.begin(), turned.end());
}

} // namespace

Result<VirtualObjects> load_virtual_objects(const std::vector<ObjectConfig>& objects,
                                            const std::filesystem::path& cache_folder, const Progress& progress) {
  VirtualObjects all;
  for (std::size_t k = 0; k < objects.size(); ++k) {
    if (!progress("objects", static_cast<double>(k) / static_cast<double>(objects.size())))
      return interrupted_error("loading objects");
    auto mesh = read_object_mesh(objects[k].model);
    if (!mesh)
      return mesh.error();
    if (mesh->triangles.empty())
      all.notes.push_back(objects[k].model.string() + ": no triangles, nothing is drawn");
    auto transfer = cached_transfer(*mesh, cache_folder, objects[k].model.stem().string());
    if (!transfer)
      return transfer.error();
    if (!transfer->note.empty())
      all.notes.push_back(transfer->note);
    ++(transfer->from_cache ? all.transfers_cached : all.transfers_computed);
    append(all, *mesh, transfer->transfer, objects[k]);
  }
  return all;
}

} // namespace daylit
