#include "precompute/detail/transport_problem.h"

namespace daylit::precompute::detail {

Result<Problem> set_up(const Room& room, const BakeOptions& options) {
  Problem p;
  Result<RayScene> room_scene = RayScene::build(room);
  if (!room_scene)
    return room_scene.error();
  p.room_scene = *room_scene;
  Result<Apertures> apertures = find_apertures(room, p.room_scene);
  if (!apertures)
    return apertures.error();
  p.apertures = std::move(*apertures);
  Result<radiosity::PatchMesh> mesh =
      radiosity::mesh_patches(room, {.edge_m = options.patch_edge_m, .target_patches = options.target_patches});
  if (!mesh)
    return mesh.error();
  p.mesh = std::move(*mesh);
  Result<RayScene> patch_rays = radiosity::patch_scene(p.mesh);
  if (!patch_rays)
    return patch_rays.error();
  p.patch_rays = *patch_rays;
  p.elements = radiosity::find_elements(room, p.mesh, p.patch_rays, p.apertures.list);
  return p;
}

ProbePoints::ProbePoints(const ProbeSet& probes, const glm::dvec3& mesh_origin) {
  for (std::size_t i = 0; i < probes.size(); ++i)
    if (probes.valid[i]) {
      probe.push_back(i);
      at.push_back(probes.origin + glm::dvec3(probes.positions[i]) - mesh_origin);
    }
}
} // namespace daylit::precompute::detail
