#include "radiosity/elements.h"

#include <limits>
#include <optional>

#include <glm/geometric.hpp>

#include "radiosity/detail/sampling.h"

namespace daylit::radiosity {

namespace {

constexpr int kSeedPoints = 16, kSeedRays = 256, kSideRays = 16, kSecondLookRays = 64;

glm::dvec3 centroid(const Patch& p) { return (p.corner[0] + p.corner[1] + p.corner[2]) / 3.0; }

/// Spreads over the patch sides that light from the openings can reach. Front = 0, back = 1.
class SideSearch {
public:
  SideSearch(const PatchMesh& mesh, const RayScene& scene)
      : mesh_(mesh), scene_(scene), reached_(mesh.patches.size(), {false, false}) {}

  /// Marks the side that a ray meets.
  void shoot(const glm::dvec3& from, const glm::dvec3& direction) {
    if (const auto met = meets(from, direction))
      mark(met->patch, met->side);
  }

  void follow() {
    do {
      while (!queue_.empty()) {
        const Side s = queue_.back();
        queue_.pop_back();
        for (std::uint32_t k = 0; k < kSideRays; ++k)
          shoot(centroid(mesh_.patches[s.patch]), away(s, k));
      }
      second_look();
    } while (!queue_.empty());
  }

  bool reached(std::uint32_t patch, int side) const { return reached_[patch][side]; }

private:
  struct Side {
    std::uint32_t patch;
    int side;
  };

  glm::dvec3 away(const Side& s, std::uint32_t k) const {
    const glm::dvec3& n = mesh_.patches[s.patch].normal;
    return cosine_direction(s.side == 0 ? n : -n, r2_point(k, random_shift(s.patch)));
  }

  std::optional<Side> meets(const glm::dvec3& from, const glm::dvec3& direction) const {
    RayHit hit;
    const glm::vec3 d(direction);
    if (!scene_.closest(scene_.to_local(from), d, scene_.surface_offset(), std::numeric_limits<float>::infinity(), hit))
      return std::nullopt;
    return Side{hit.triangle, glm::dot(glm::dvec3(d), mesh_.patches[hit.triangle].normal) < 0.0 ? 0 : 1};
  }

  void mark(std::uint32_t patch, int side) {
    if (reached_[patch][side])
      return;
    reached_[patch][side] = true;
    queue_.push_back({patch, side});
  }

  /// Few rays find small patches; those on planes that were met look for a reached side, or the sky, themselves.
  void second_look() {
    std::vector<std::array<bool, 2>> plane_met(mesh_.planes, {false, false});
    for (std::uint32_t i = 0; i < mesh_.patches.size(); ++i)
      for (int side = 0; side < 2; ++side)
        plane_met[mesh_.patches[i].plane][side] = plane_met[mesh_.patches[i].plane][side] || reached_[i][side];
    for (std::uint32_t i = 0; i < mesh_.patches.size(); ++i)
      for (int side = 0; side < 2; ++side)
        if (plane_met[mesh_.patches[i].plane][side] && !reached_[i][side] && sees_light({i, side}))
          mark(i, side);
  }

  bool sees_light(const Side& s) const {
    for (std::uint32_t k = 0; k < kSecondLookRays; ++k) {
      const auto met = meets(centroid(mesh_.patches[s.patch]), away(s, k));
      if (!met || reached_[met->patch][met->side])
        return true;
    }
    return false;
  }

  const PatchMesh& mesh_;
  const RayScene& scene_;
  std::vector<std::array<bool, 2>> reached_;
  std::vector<Side> queue_;
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
      if (!search.reached(i, side)) {
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
