#include "runtime/trace/glass_faces.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include <glm/geometric.hpp>

#include "scene/model/straight_light.h"

namespace daylit {

namespace {

constexpr int kMostFaces = 16;       // on one way; more let nothing through that could be seen
constexpr float kNextFace_m = 2e-5f; // beyond a face, the next is looked for

void set_rgb(LaneRgb& values, int lane, const Rgb& value) {
  for (int c = 0; c < 3; ++c)
    values.channel[c][lane] = value[c];
}

Rgb get_rgb(const LaneRgb& values, int lane) {
  return {values.channel[0][lane], values.channel[1][lane], values.channel[2][lane]};
}

} // namespace

std::vector<std::uint8_t> GlassFaces::mark(const ObjectSurface& objects) {
  std::vector<std::uint8_t> is_glass(objects.triangles.size(), 0);
  for (const GlassObject& object : objects.glass)
    for (std::size_t t = 0; t < object.mesh->triangles.size(); ++t)
      if (const ObjectMaterial* m = object.mesh->material_or_null(t); m && m->is_transparent())
        is_glass[object.first_triangle + t] = 1;
  return is_glass;
}

Result<GlassFaces> GlassFaces::build(const ObjectSurface& objects, std::span<const glm::vec3> positions) {
  GlassFaces glass;
  glass.objects_ = objects.glass;
  const std::vector<std::uint8_t> is_glass = mark(objects);
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const GlassObject& object : objects.glass) {
    for (std::uint32_t t = 0; t < object.mesh->triangles.size(); ++t)
      if (const std::uint32_t all = object.first_triangle + t; is_glass[all]) {
        glass.faces_.push_back({object.mesh.get(), t, all, {}});
        triangles.push_back(objects.triangles[all]);
      }
  }
  auto built = PacketScene::build(positions, triangles);
  if (!built)
    return built.error();
  glass.rays_ = std::move(*built);
  glass.find_normals(objects, positions);
  return glass;
}

void GlassFaces::find_normals(const ObjectSurface& objects, std::span<const glm::vec3> positions) {
  for (Face& face : faces_) {
    const auto& t = objects.triangles[face.triangle];
    const glm::vec3 n = glm::cross(positions[t[1]] - positions[t[0]], positions[t[2]] - positions[t[0]]);
    const float length = glm::length(n);
    face.normal = length > 0.0f ? n / length : glm::vec3(0.0f);
  }
}

Result<void> GlassFaces::move(const ObjectSurface& objects, std::span<const glm::vec3> positions,
                              const Similarity* rigid) {
  find_normals(objects, positions);
  if (!rigid)
    return rays_.move(positions);
  rays_.set_transform(*rigid);
  return {};
}

/// Product over the faces on the way of straight_transmittance().
LaneMask GlassFaces::pass(LaneMask lanes, const RayPacket16& rays, LaneRgb& left) const {
  for (auto& channel : left.channel)
    std::fill(channel, channel + kLanes, 1.0f);
  RayPacket16 rest = rays;
  RayHits16 hits;
  float before[kLanes]; // where the way to the next face begins
  std::copy(rays.tnear, rays.tnear + kLanes, before);
  LaneMask met = 0, going = lanes;
  for (int count = 0; going != 0 && count < kMostFaces; ++count) {
    rays_.closest(going, rest, hits);
    for (std::uint32_t open = std::exchange(going, 0u); open; open &= open - 1) {
      const int k = std::countr_zero(open);
      if (hits.triangle[k] == kNoTriangle)
        continue;
      const Face& face = faces_[hits.triangle[k]];
      const float at = hits.distance[k];
      const float cosine = glm::dot(face.normal, glm::vec3(rays.dir_x[k], rays.dir_y[k], rays.dir_z[k]));
      const Rgb through = get_rgb(left, k) * straight_transmittance(*face.mesh, face.own_triangle, hits.u[k], hits.v[k],
                                                                    cosine, at - before[k]);
      set_rgb(left, k, through);
      met |= 1u << k;
      going |= through == Rgb(0.0f) ? 0u : 1u << k;
      before[k] = at;
      rest.tnear[k] = at * (1.0f + 0x1p-20f) + kNextFace_m;
    }
  }
  for (; going; going &= going - 1)
    set_rgb(left, std::countr_zero(going), Rgb(0.0f));
  return met;
}

} // namespace daylit
