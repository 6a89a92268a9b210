#include "radiosity/elements.h"

#include <glm/geometric.hpp>

#include "radiosity/detail/sampling.h"

namespace daylit::radiosity {

namespace {

constexpr int kSeedPoints = 16, kSeedRays = 256, kSideRays = 16;
using PlaneSide = std::array<bool, 2>;

glm::dvec3 centroid(const Patch& p) { return (p.corner[0] + p.corner[1] + p.corner[2]) / 3.0; }

/// Marks the plane sides that rays from `from` meet, and queues those met for the first time.
class SideSearch {
public:
  SideSearch(const PatchMesh& mesh, const RayScene& scene)
      : mesh_(mesh), scene_(scene), reached_(mesh.planes, {false, false}), patches_(mesh.planes) {
    for (std::uint32_t i = 0; i < mesh.patches.size(); ++i)
      patches_[mesh.patches[i].plane].push_back(i);
  }

  void shoot(const glm::dvec3& from, const glm::dvec3& direction) {
    RayHit hit;
    const glm::vec3 d(direction);
    if (!scene_.closest(scene_.to_local(from), d, scene_.surface_offset(), std::numeric_limits<float>::infinity(), hit))
      return;
    const Patch& p = mesh_.patches[hit.triangle];
    const int side = glm::dot(glm::dvec3(d), p.normal) < 0.0 ? 0 : 1;
    if (reached_[p.plane][side])
      return;
    reached_[p.plane][side] = true;
    queue_.push_back({p.plane, side});
  }

  void follow() {
    while (!queue_.empty()) {
      const auto [plane, side] = queue_.back();
      queue_.pop_back();
      for (const std::uint32_t i : patches_[plane])
        for (std::uint32_t k = 0; k < kSideRays; ++k) {
          const Patch& p = mesh_.patches[i];
          shoot(centroid(p), cosine_direction(side == 0 ? p.normal : -p.normal, r2_point(k, random_shift(i))));
        }
    }
  }

  const std::vector<PlaneSide>& reached() const { return reached_; }

private:
  struct Item {
    std::uint32_t plane;
    int side;
  };
  const PatchMesh& mesh_;
  const RayScene& scene_;
  std::vector<PlaneSide> reached_;
  std::vector<std::vector<std::uint32_t>> patches_;
  std::vector<Item> queue_;
};

glm::dvec3 mean_corner(const Aperture& a) {
  glm::dvec3 sum(0.0);
  for (const glm::dvec3& c : a.corners)
    sum += c;
  return sum / static_cast<double>(a.corners.size());
}

} // namespace

std::int32_t ElementSet::hit(const PatchMesh& mesh, std::uint32_t patch, const glm::vec3& direction) const {
  return of_patch[patch][glm::dot(glm::dvec3(direction), mesh.patches[patch].normal) < 0.0 ? 0 : 1];
}

Result<RayScene> patch_scene(const PatchMesh& mesh) {
  std::vector<glm::dvec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  vertices.reserve(3 * mesh.patches.size());
  for (const Patch& p : mesh.patches) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    vertices.insert(vertices.end(), p.corner.begin(), p.corner.end());
    triangles.push_back({first, first + 1, first + 2});
  }
  return RayScene::build(vertices, triangles);
}

ElementSet find_elements(const Room& room, const PatchMesh& mesh, const RayScene& scene,
                         const std::vector<Aperture>& apertures) {
  SideSearch search(mesh, scene);
  for (std::size_t a = 0; a < apertures.size(); ++a) {
    const glm::dvec3 middle = mean_corner(apertures[a]) - mesh.origin;
    for (std::uint32_t s = 0; s < kSeedPoints; ++s) {
      // Points spread over the opening, a hair's breadth inside.
      const glm::dvec3 rim = apertures[a].corners[s % apertures[a].corners.size()] - mesh.origin;
      const glm::dvec3 p = glm::mix(middle, rim, 0.9 * s / kSeedPoints) + 1e-4 * apertures[a].inward;
      for (std::uint32_t k = 0; k < kSeedRays; ++k)
        search.shoot(p, sphere_direction(r2_point(k, random_shift(a * kSeedPoints + s))));
    }
  }
  search.follow();

  ElementSet set;
  set.of_patch.assign(mesh.patches.size(), {-1, -1});
  for (std::uint32_t i = 0; i < mesh.patches.size(); ++i) {
    const Patch& p = mesh.patches[i];
    for (int side = 0; side < 2; ++side) {
      if (!search.reached()[p.plane][side]) {
        ++set.sides_skipped;
        continue;
      }
      Element e{p.corner, p.normal, p.area_m2, room.materials[p.material].reflectance, i};
      if (side == 1) {
        std::swap(e.corner[1], e.corner[2]);
        e.normal = -e.normal;
      }
      set.of_patch[i][side] = static_cast<std::int32_t>(set.elements.size());
      set.elements.push_back(e);
    }
  }
  return set;
}

} // namespace daylit::radiosity
