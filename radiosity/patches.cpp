#include "radiosity/patches.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include <glm/geometric.hpp>

#include "radiosity/detail/near_facets.h"
#include "radiosity/detail/sampling.h"
#include "radiosity/polygon_kernel.h"
#include "scene/core/parallel.h"

namespace daylit::radiosity {

namespace {

constexpr int kSeedPoints = 16, kSeedRays = 256, kSideRays = 16, kSecondLookRays = 64, kGreetingRays = 8;
constexpr int kOutdoorRays = 24; // all of them lost in the sky: the outside of a wall
// Meshes of planes that meet do not share vertices: between them are cracks one float rounding wide. A ray counts when
// rays beside it, moved by far more than that at both ends and ending on the same facet, arrive too: beyond the facet's
// edge may be the inside of a wall. Lengths in units of RayScene::surface_offset.
constexpr double kRaised = 1.0, kBeside = 64.0, kBesideAtLeast = 8.0;
constexpr double kThin = 8.0;       // a facet lower than this may be what rounding left of a floor behind its wall
constexpr double kSeedDepth = 16.0; // of the points in the openings where the search starts
constexpr int kWitnesses = 4, kWitnessesNeeded = 2;
// Two sides of a narrow gap that meet few of each other's rays are joined by segments between the parts that face.
constexpr double kJoinReach = 0.5; // of the longest edge: farther ones are met by rays
constexpr int kJoins = 8, kJoinsNeeded = 2;
constexpr double kJoinHeight = 16.0; // over each other's plane; less is a rounding, no gap

glm::dvec3 centroid(const Facet& p) { return (p.corner[0] + p.corner[1] + p.corner[2]) / 3.0; }

double longest_edge_m(const Facet& p) {
  return std::max({glm::distance(p.corner[0], p.corner[1]), glm::distance(p.corner[1], p.corner[2]),
                   glm::distance(p.corner[2], p.corner[0])});
}

/// Smallest height of the triangle, metres.
double height_m(const Facet& p) { return 2.0 * p.area_m2 / longest_edge_m(p); }

/// The part of a triangle in front of a plane; empty when it rises above it by less than `least_m`.
SmallPolygon part_above(const Facet& p, const glm::dvec3& point, const glm::dvec3& normal, double least_m) {
  double highest = 0;
  for (const glm::dvec3& c : p.corner)
    highest = std::max(highest, glm::dot(c - point, normal));
  return highest < least_m ? SmallPolygon{}
                           : clip_to_front({{p.corner[0], p.corner[1], p.corner[2]}, 3}, point, normal);
}

/// A point of a convex polygon of three or four corners, spread over all of it.
glm::dvec3 on_polygon(const SmallPolygon& p, const glm::dvec2& u) {
  const auto at = [&](int k) { return p.corner[static_cast<std::size_t>(k)]; };
  if (p.size < 4)
    return on_triangle({at(0), at(1), at(2)}, u);
  return glm::mix(glm::mix(at(0), at(1), u.x), glm::mix(at(3), at(2), u.x), u.y);
}

struct Side {
  std::uint32_t facet;
  int side; ///< 0 front, 1 back
};

/// A side and the point of it that a ray meets.
struct Meeting {
  Side side;
  glm::dvec3 point;
};

/// Where a ray starts or ends, how far away a witness may stand, and the facet that it stands on; in the air there is
/// none, and it stands across the ray.
struct RayEnd {
  glm::dvec3 point, normal;
  double beside_m;
  const Facet* facet = nullptr;

  /// On a facet a step towards some other point of it, never beyond its edges.
  glm::dvec3 witness(const glm::dvec2& u) const {
    if (facet != nullptr) {
      glm::dvec3 way = on_triangle(facet->corner, u) - point;
      way -= glm::dot(way, normal) * normal;
      return point + std::min(1.0, beside_m / glm::length(way)) * way;
    }
    const OrthonormalBasis basis(normal);
    const double angle = 2.0 * std::numbers::pi * u.x;
    return point + beside_m * (std::cos(angle) * basis.u + std::sin(angle) * basis.v);
  }
};

/// Spreads over the facet sides that light from the openings can reach.
class SideSearch {
public:
  SideSearch(const SurfaceMesh& mesh, const RayScene& scene)
      : mesh_(mesh), scene_(scene), near_(mesh), offset_m_(scene.surface_offset()), reached_(mesh.facets.size()) {}

  double offset_m() const { return offset_m_; }

  /// Marks the sides seen from a point of the air.
  void look_around(const glm::dvec3& point, std::uint64_t seed) {
    for (std::uint32_t k = 0; k < kSeedRays; ++k) {
      const glm::dvec3 d = sphere_direction(r2_point(k, random_shift(seed)));
      if (const auto met = new_side({point, d, kBeside * offset_m_}, d, mix_bits(seed) + k))
        mark(*met);
    }
  }

  /// Nothing but reached sides is seen from a point of the air, as far as a few rays tell.
  bool familiar(const glm::dvec3& point, std::uint64_t seed) const {
    for (std::uint32_t k = 0; k < kGreetingRays; ++k) {
      const auto met = meets(point, sphere_direction(r2_point(k, random_shift(seed))));
      if (met && !reached(met->side))
        return false;
    }
    return true;
  }

  /// Every round looks from the sides that the round before found. The set reached does not depend on any order.
  void follow() {
    do {
      while (!frontier_.empty()) {
        const std::vector<Side> from = std::exchange(frontier_, {});
        std::vector<std::array<std::optional<Meeting>, kSideRays>> found(from.size());
        parallel_for(std::size_t{0}, from.size(), [&](std::size_t i) {
          for (std::uint32_t k = 0; k < kSideRays; ++k)
            found[i][k] = new_side(end_on(from[i], lit_point(from[i])), away(from[i], k), ray_seed(from[i], k));
        });
        for (const auto& rays : found)
          for (const std::optional<Meeting>& met : rays)
            if (met)
              mark(*met);
      }
      second_look();
    } while (!frontier_.empty());
  }

  bool reached(const Side& s) const { return reached_[s.facet][s.side].has_value(); }

private:
  glm::dvec3 outward(const Side& s) const {
    const glm::dvec3& n = mesh_.facets[s.facet].normal;
    return s.side == 0 ? n : -n;
  }
  glm::dvec3 away(const Side& s, std::uint32_t k) const {
    return cosine_direction(outward(s), r2_point(k, random_shift(s.facet)));
  }
  /// Raised, because a flat ray that starts in the rounded plane meets the neighbours from behind.
  RayEnd end_on(const Side& s, const glm::dvec3& point) const {
    const double beside =
        std::clamp(0.25 * height_m(mesh_.facets[s.facet]), kBesideAtLeast * offset_m_, kBeside * offset_m_);
    return {point + kRaised * offset_m_ * outward(s), outward(s), beside, &mesh_.facets[s.facet]};
  }
  static std::uint64_t ray_seed(const Side& s, std::uint32_t k) {
    return mix_bits(2ull * s.facet + static_cast<std::uint64_t>(s.side)) + k;
  }

  const glm::dvec3& lit_point(const Side& s) const { return *reached_[s.facet][s.side]; }

  /// Side of the first facet on the ray; nothing when the ray leaves.
  std::optional<Meeting> meets(const glm::dvec3& from, const glm::dvec3& direction) const {
    RayHit hit;
    const glm::vec3 d(direction);
    if (!scene_.closest(scene_.to_local(from), d, 0.0f, std::numeric_limits<float>::infinity(), hit))
      return std::nullopt;
    return Meeting{{hit.triangle, glm::dot(glm::dvec3(d), mesh_.facets[hit.triangle].normal) < 0.0 ? 0 : 1},
                   from + static_cast<double>(hit.distance) * direction};
  }

  std::optional<Meeting> new_side(const RayEnd& from, const glm::dvec3& d, std::uint64_t seed) const {
    const auto met = meets(from.point, d);
    if (!met || reached(met->side) || !witnessed(from, end_on(met->side, met->point), seed))
      return std::nullopt;
    return met;
  }

  bool clear(const glm::dvec3& from, const glm::dvec3& way) const {
    return !scene_.occluded(scene_.to_local(from), glm::vec3(way), 0.0f, 1.0f);
  }

  bool witnessed(const RayEnd& from, const RayEnd& to, std::uint64_t seed) const {
    int seen = 0;
    for (std::uint32_t k = 0; k < kWitnesses && seen < kWitnessesNeeded; ++k) {
      const glm::dvec3 start = from.witness(r2_point(k, random_shift(seed)));
      const glm::dvec3 way = to.witness(r2_point(k, random_shift(~seed))) - start;
      seen += clear(start, way) ? 1 : 0;
    }
    return seen >= kWitnessesNeeded;
  }

  void mark(const Meeting& met) {
    if (reached(met.side))
      return;
    reached_[met.side.facet][met.side.side] = met.point;
    if (!thin(met.side.facet))
      frontier_.push_back(met.side);
  }

  bool thin(std::uint32_t facet) const { return height_m(mesh_.facets[facet]) < kThin * offset_m_; }
  /// Others may be lit by it.
  bool passes_on(const Side& s) const { return reached(s) && !thin(s.facet); }
  /// Nothing on a reached side divides a point from the one that is known to be lit: of two cushions that lie in each
  /// other every facet across the seam has a part in the dark.
  bool in_the_light(const Meeting& met) const {
    return std::ranges::none_of(std::array{kRaised, kBesideAtLeast}, [&](double raised) {
      const glm::dvec3 from = lit_point(met.side) + raised * offset_m_ * outward(met.side);
      return !clear(from, met.point - lit_point(met.side));
    });
  }

  /// Few rays find small facets: those not found look for a reached side themselves. One that sees nothing but sky
  /// sends nothing into the room.
  void second_look() {
    std::vector<std::array<std::optional<glm::dvec3>, 2>> lit(mesh_.facets.size());
    parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(mesh_.facets.size()), [&](std::uint32_t i) {
      for (int side = 0; side < 2; ++side)
        if (!reached({i, side}))
          lit[i][side] = sees_light({i, side}) ? centroid(mesh_.facets[i]) : sees_neighbour({i, side});
    });
    for (std::uint32_t i = 0; i < mesh_.facets.size(); ++i)
      for (int side = 0; side < 2; ++side)
        if (lit[i][side])
          mark({{i, side}, *lit[i][side]});
  }

  bool sees_light(const Side& s) const {
    const RayEnd from = end_on(s, centroid(mesh_.facets[s.facet]));
    bool outdoors = true;
    for (std::uint32_t k = 0; k < kSecondLookRays && (k < kOutdoorRays || !outdoors); ++k) {
      const auto met = meets(from.point, away(s, k));
      outdoors = outdoors && !met;
      if (met && passes_on(met->side) && in_the_light(*met) &&
          witnessed(from, end_on(met->side, met->point), ray_seed(s, k)))
        return true;
    }
    return false;
  }

  /// The point of this side that a reached one close by sees, though hardly a ray from its middle arrives there: a gap
  /// much narrower than its facets.
  std::optional<glm::dvec3> sees_neighbour(const Side& s) const {
    std::optional<glm::dvec3> found;
    near_.visit(s.facet, kJoinReach * longest_edge_m(mesh_.facets[s.facet]), [&](std::uint32_t facet) {
      for (int side = 0; side < 2 && !found; ++side)
        if (passes_on({facet, side}))
          found = joined(s, {facet, side});
      return !found;
    });
    return found;
  }

  std::optional<glm::dvec3> joined(const Side& s, const Side& t) const {
    const Facet &p = mesh_.facets[s.facet], &q = mesh_.facets[t.facet];
    const double least_m = kJoinHeight * offset_m_;
    const SmallPolygon from = part_above(p, q.corner[0], outward(t), least_m);
    const SmallPolygon to = from.size < 3 ? from : part_above(q, p.corner[0], outward(s), least_m);
    int seen = 0;
    glm::dvec3 point(0.0);
    for (std::uint32_t k = 0; k < kJoins && to.size >= 3 && seen < kJoinsNeeded; ++k) {
      point = on_polygon(from, r2_point(k, random_shift(ray_seed(s, t.facet))));
      const glm::dvec3 other = on_polygon(to, r2_point(k, random_shift(ray_seed(t, s.facet))));
      const RayEnd start = end_on(s, point), end = end_on(t, other);
      const bool found = clear(start.point, end.point - start.point) && in_the_light({t, other}) &&
                         witnessed(start, end, ray_seed(s, t.facet + k));
      seen += found ? 1 : 0;
    }
    return seen >= kJoinsNeeded ? std::optional(point) : std::nullopt;
  }

  const SurfaceMesh& mesh_;
  const RayScene& scene_;
  NearFacets near_;
  double offset_m_;
  /// A point of every reached side, where light arrives.
  std::vector<std::array<std::optional<glm::dvec3>, 2>> reached_;
  std::vector<Side> frontier_;
};

glm::dvec3 mean_corner(const Aperture& a) {
  glm::dvec3 sum(0.0);
  for (const glm::dvec3& c : a.corners)
    sum += c;
  return sum / static_cast<double>(a.corners.size());
}

} // namespace

std::int32_t PatchSet::hit(const SurfaceMesh& mesh, std::uint32_t facet, const glm::vec3& direction) const {
  return of_facet[facet][glm::dot(glm::dvec3(direction), mesh.facets[facet].normal) < 0.0 ? 0 : 1];
}

/// Three vertices of its own for every facet: hit index = facet index.
Result<RayScene> facet_scene(const SurfaceMesh& mesh) {
  std::vector<glm::dvec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  vertices.reserve(3 * mesh.facets.size());
  for (const Facet& p : mesh.facets) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    vertices.insert(vertices.end(), p.corner.begin(), p.corner.end());
    triangles.push_back({first, first + 1, first + 2});
  }
  return RayScene::build(vertices, triangles);
}

namespace {

/// From just inside the openings.
void follow_light(SideSearch& search, const SurfaceMesh& mesh, const std::vector<Aperture>& apertures) {
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
}

/// From the receivers: light takes the same ways back.
void follow_receivers(SideSearch& search, std::span<const glm::dvec3> receivers) {
  for (std::size_t k = 0; k < receivers.size(); ++k)
    if (k == 0 || !search.familiar(receivers[k], mix_bits(k))) {
      search.look_around(receivers[k], mix_bits(k));
      search.follow();
    }
}

} // namespace

/// A side is a patch when light reaches it and, if receivers are given, it reaches a receiver.
PatchSet find_patches(const Room& room, const SurfaceMesh& mesh, const RayScene& scene,
                      const std::vector<Aperture>& apertures, std::span<const glm::dvec3> receivers) {
  SideSearch light(mesh, scene), receiving(mesh, scene);
  follow_light(light, mesh, apertures);
  follow_receivers(receiving, receivers);

  PatchSet set;
  set.of_facet.assign(mesh.facets.size(), {-1, -1});
  for (std::uint32_t i = 0; i < mesh.facets.size(); ++i) {
    const Facet& p = mesh.facets[i];
    for (int side = 0; side < 2; ++side) {
      if (!light.reached({i, side})) {
        ++set.sides_skipped;
        continue;
      }
      if (!receivers.empty() && !receiving.reached({i, side})) {
        ++set.sides_without_path;
        continue;
      }
      Patch e{p.corner, p.normal, p.area_m2, room.materials[p.material].reflectance, i};
      if (side == 1) {
        std::swap(e.corner[1], e.corner[2]);
        e.normal = -e.normal;
      }
      set.of_facet[i][side] = static_cast<std::int32_t>(set.patches.size());
      set.patches.push_back(e);
    }
  }
  return set;
}

} // namespace daylit::radiosity
