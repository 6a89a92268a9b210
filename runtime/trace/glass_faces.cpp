#include "runtime/trace/glass_faces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>

#include "scene/material/fresnel.h"
#include "scene/model/straight_light.h"

namespace daylit {

std::vector<std::uint8_t> GlassFaces::mark(const ObjectSurface& objects) {
  std::vector<std::uint8_t> is_glass(objects.triangles.size(), 0);
  for (const GlassObject& object : objects.glass)
    for (std::size_t t = 0; t < object.mesh->triangles.size(); ++t)
      if (const ObjectMaterial* m = object.mesh->material_or_null(t); m && m->is_transparent())
        is_glass[object.first_triangle + t] = 1;
  return is_glass;
}

GlassFaces::Face GlassFaces::face_of(const ObjectMesh& mesh, std::uint32_t own, std::uint32_t triangle) {
  const ObjectMaterial& m = *mesh.material_or_null(own);
  return {&mesh,
          own,
          triangle,
          glm::vec3(0.0f),
          has_even_colour(mesh, own),
          straight_colour(mesh, own, 1.0f / 3.0f, 1.0f / 3.0f),
          m.thin ? Rgb(0.0f) : m.absorption_per_m(),
          m.ior};
}

Result<GlassFaces> GlassFaces::build(const ObjectSurface& objects, std::span<const glm::vec3> positions) {
  GlassFaces glass;
  glass.objects_ = objects.glass;
  const std::vector<std::uint8_t> is_glass = mark(objects);
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const GlassObject& object : objects.glass) {
    for (std::uint32_t t = 0; t < object.mesh->triangles.size(); ++t)
      if (const std::uint32_t all = object.first_triangle + t; is_glass[all]) {
        glass.faces_.push_back(face_of(*object.mesh, t, all));
        triangles.push_back(objects.triangles[all]);
      }
  }
  auto built = PacketScene::build(positions, triangles, PacketScene::Edges::watertight, PacketScene::Hits::all_too);
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

/// On the ways of a packet.
class GlassFaces::Passing final : public HitVisitor {
public:
  Passing(const std::vector<Face>& faces, const RayPacket16& rays) : faces_(faces), rays_(rays) {
    left_.fill(Rgb(1.0f));
  }

  /// Of a way inside solid glass the far end counts, less the near end.
  void meet(int k, std::uint32_t triangle, float distance, float u, float v) override {
    const Face& face = faces_[triangle];
    const float cosine = glm::dot(face.normal, glm::vec3(rays_.dir_x[k], rays_.dir_y[k], rays_.dir_z[k]));
    const auto lane = static_cast<std::size_t>(k);
    left_[lane] *= (1.0f - fresnel_dielectric(std::abs(cosine), face.ior)) *
                   (face.has_even_colour ? face.colour : straight_colour(*face.mesh, face.own_triangle, u, v));
    depth_[lane] += std::copysign(distance - rays_.tnear[k], cosine) * face.absorption_per_m;
    met_ |= 1u << k;
  }
  LaneMask met() const { return met_; }
  Rgb left(std::size_t k) const {
    return met_ >> k & 1u ? left_[k] * glm::exp(-glm::max(depth_[k], Rgb(0.0f))) : Rgb(1.0f);
  }

private:
  const std::vector<Face>& faces_;
  const RayPacket16& rays_;
  std::array<Rgb, kLanes> left_, depth_{};
  LaneMask met_ = 0;
};

/// Product over the faces on the way of straight_transmittance(), for which no order matters.
LaneMask GlassFaces::pass(LaneMask lanes, const RayPacket16& rays, LaneRgb& left) const {
  Passing passing(faces_, rays);
  rays_.all(lanes, rays, passing);
  for (std::size_t k = 0; k < kLanes; ++k) {
    const Rgb of_lane = passing.left(k);
    for (int c = 0; c < 3; ++c)
      left.channel[c][k] = of_lane[c];
  }
  return passing.met();
}

} // namespace daylit
