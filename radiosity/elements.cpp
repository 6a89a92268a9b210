#include "radiosity/elements.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include <glm/geometric.hpp>
#include <tbb/parallel_for.h>

#include "radiosity/detail/sampling.h"

namespace daylit::radiosity {

namespace {

constexpr int kSeedPoints = 16, kSeedRays = 256, kSideRays = 16, kSecondLookRays = 64;
constexpr int kOutdoorRays = 24; // all of them lost in the sky: the outside of a wall
// Meshes of planes that meet do not share vertices: between them are cracks one float rounding wide. A ray counts when
// rays beside it, moved by far more than that at both ends, arrive too. Lengths in units of RayScene::surface_offset.
constexpr double kRaised = 1.0, kBeside = 64.0, kBesideAtLeast = 8.0;
constexpr double kSeedDepth = 16.0; // of the points in the openings where the search starts
constexpr int kWitnesses = 4, kWitnessesNeeded = 2;

glm::dvec3 centroid(const Patch& p) { return (p.corner[0] + p.corner[1] + p.corner[2]) / 3.0; }

/// Smallest height of the triangle, metres.
double height_m(const Patch& p) {
  double longest = 0;
  for (int k = 0; k < 3; ++k)
    longest = std::max(longest, glm::distance(p.corner[k], p.corner[(k + 1) % 3]));
  return 2.0 * p.area_m2 / longest;
}

struct Side {
  std::uint32_t patch;
  int side; ///< 0 front, 1 back
};

/// Where a ray starts or ends, the plane there, and how far away in that plane a witness may stand.
struct RayEnd {
  glm::dvec3 point, normal;
  double beside_m;

  glm::dvec3 witness(double turn) const {
    const auto [t, b] = tangents(normal);
    const double angle = 2.0 * std::numbers::pi * turn;
    return point + beside_m * (std::cos(angle) * t + std::sin(angle) * b);
  }
};

/// Spreads over the patch sides that light from the openings can reach.
class SideSearch {
public:
  SideSearch(const PatchMesh& mesh, const RayScene& scene)
      : mesh_(mesh), scene_(scene), offset_m_(scene.surface_offset()), reached_(mesh.patches.size(), {false, false}) {}

  double offset_m() const { return offset_m_; }

  /// Marks the sides seen from a point of the air.
  void look_around(const glm::dvec3& point, std::uint64_t seed) {
    for (std::uint32_t k = 0; k < kSeedRays; ++k) {
      const glm::dvec3 d = sphere_direction(r2_point(k, random_shift(seed)));
      if (const auto met = new_side({point, d, kBeside * offset_m_}, d, mix_bits(seed) + k))
        mark(*met);
    }
  }

  /// Every round looks from the sides that the round before found. The set reached does not depend on any order.
  void follow() {
    do {
      while (!frontier_.empty()) {
        const std::vector<Side> from = std::exchange(frontier_, {});
        std::vector<std::array<std::optional<Side>, kSideRays>> found(from.size());
        tbb::parallel_for(std::size_t{0}, from.size(), [&](std::size_t i) {
          for (std::uint32_t k = 0; k < kSideRays; ++k)
            found[i][k] = new_side(end_on(from[i], centroid(mesh_.patches[from[i].patch])), away(from[i], k),
                                   ray_seed(from[i], k));
        });
        for (const auto& rays : found)
          for (const std::optional<Side>& met : rays)
            if (met)
              mark(*met);
      }
      second_look();
    } while (!frontier_.empty());
  }

  bool reached(std::uint32_t patch, int side) const { return reached_[patch][side]; }

private:
  glm::dvec3 outward(const Side& s) const {
    const glm::dvec3& n = mesh_.patches[s.patch].normal;
    return s.side == 0 ? n : -n;
  }
  glm::dvec3 away(const Side& s, std::uint32_t k) const {
    return cosine_direction(outward(s), r2_point(k, random_shift(s.patch)));
  }
  /// Raised, because a flat ray that starts in the rounded plane meets the neighbours from behind.
  RayEnd end_on(const Side& s, const glm::dvec3& point) const {
    const double beside =
        std::clamp(0.25 * height_m(mesh_.patches[s.patch]), kBesideAtLeast * offset_m_, kBeside * offset_m_);
    return {point + kRaised * offset_m_ * outward(s), outward(s), beside};
  }
  static std::uint64_t ray_seed(const Side& s, std::uint32_t k) {
    return mix_bits(2ull * s.patch + static_cast<std::uint64_t>(s.side)) + k;
  }

  /// Side of the first patch on the ray; nothing when the ray leaves.
  std::optional<Side> meets(const glm::dvec3& from, const glm::dvec3& direction, double& distance) const {
    RayHit hit;
    const glm::vec3 d(direction);
    if (!scene_.closest(scene_.to_local(from), d, 0.0f, std::numeric_limits<float>::infinity(), hit))
      return std::nullopt;
    distance = static_cast<double>(hit.distance);
    return Side{hit.triangle, glm::dot(glm::dvec3(d), mesh_.patches[hit.triangle].normal) < 0.0 ? 0 : 1};
  }

  std::optional<Side> new_side(const RayEnd& from, const glm::dvec3& d, std::uint64_t seed) const {
    double distance = 0.0;
    const auto met = meets(from.point, d, distance);
    if (!met || reached_[met->patch][met->side] || !witnessed(from, end_on(*met, from.point + distance * d), seed))
      return std::nullopt;
    return met;
  }

  bool witnessed(const RayEnd& from, const RayEnd& to, std::uint64_t seed) const {
    int seen = 0;
    for (std::uint32_t k = 0; k < kWitnesses && seen < kWitnessesNeeded; ++k) {
      const glm::dvec2 turn = r2_point(k, random_shift(seed));
      const glm::dvec3 start = from.witness(turn.x), way = to.witness(turn.y) - start;
      seen += scene_.occluded(scene_.to_local(start), glm::vec3(way), 0.0f, 1.0f) ? 0 : 1;
    }
    return seen >= kWitnessesNeeded;
  }

  void mark(const Side& s) {
    if (!std::exchange(reached_[s.patch][s.side], true))
      frontier_.push_back(s);
  }

  /// Few rays find small patches: those not found look for a reached side themselves. One that sees nothing but sky
  /// sends nothing into the room.
  void second_look() {
    std::vector<std::array<char, 2>> lit(mesh_.patches.size(), {0, 0});
    tbb::parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(mesh_.patches.size()), [&](std::uint32_t i) {
      for (int side = 0; side < 2; ++side)
        lit[i][side] = !reached_[i][side] && sees_light({i, side});
    });
    for (std::uint32_t i = 0; i < mesh_.patches.size(); ++i)
      for (int side = 0; side < 2; ++side)
        if (lit[i][side])
          mark({i, side});
  }

  bool sees_light(const Side& s) const {
    const RayEnd from = end_on(s, centroid(mesh_.patches[s.patch]));
    bool outdoors = true;
    for (std::uint32_t k = 0; k < kSecondLookRays && (k < kOutdoorRays || !outdoors); ++k) {
      const glm::dvec3 d = away(s, k);
      double distance = 0.0;
      const auto met = meets(from.point, d, distance);
      outdoors = outdoors && !met;
      if (met && reached_[met->patch][met->side] &&
          witnessed(from, end_on(*met, from.point + distance * d), ray_seed(s, k)))
        return true;
    }
    return false;
  }

  const PatchMesh& mesh_;
  const RayScene& scene_;
  double offset_m_;
  std::vector<std::array<bool, 2>> reached_;
  std::vector<Side> frontier_;
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
      const double inside_m = kSeedDepth * search.offset_m();
      search.look_around(glm::mix(middle, rim, 0.9 * s / kSeedPoints) + inside_m * apertures[a].inward,
                         a * kSeedPoints + s);
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
