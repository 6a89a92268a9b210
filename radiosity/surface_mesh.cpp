#include "radiosity/surface_mesh.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

#include "radiosity/detail/near_edges.h"
#include "radiosity/detail/near_holes.h"
#include "radiosity/detail/near_panes.h"
#include "radiosity/detail/plane_groups.h"
#include "radiosity/detail/plane_mesher.h"
#include "radiosity/detail/slats.h"
#include "scene/core/parallel.h"

namespace daylit::radiosity {

namespace {

// End points closer than this part of the room are one point: above coordinate rounding, below any real feature.
constexpr double kSnapTolerance = 1e-6;
constexpr std::size_t kManyFixed = 100;        // with fewer, what the faces make by themselves is no matter
constexpr std::size_t kMostBesidePanes = 1000; // in a hall with twenty windows one sill is worth little
constexpr int kAttempts = 8;                   // at the edge length that gives the wanted number of facets

double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

void append_facets(const std::vector<Triangle2>& triangles, const PlaneGroup& g, std::uint32_t plane,
                   std::vector<Facet>& out) {
  for (const Triangle2& t : triangles) {
    Facet p;
    for (int k = 0; k < 3; ++k)
      p.corner[k] = g.lift(t[k]);
    p.normal = g.normal;
    p.area_m2 = 0.5 * glm::length(glm::cross(p.corner[1] - p.corner[0], p.corner[2] - p.corner[0]));
    p.plane = plane;
    p.material = g.material;
    if (p.area_m2 > 0.0)
      out.push_back(p);
  }
}

/// Longest edge at a point of a group, metres.
using EdgeLength = std::function<double(const glm::dvec3&, std::size_t)>;

std::vector<Facet> mesh_groups(const std::vector<PlaneGroup>& groups,
                               const std::vector<std::vector<Segment2>>& outlines, const EdgeLength& edge_m,
                               std::size_t limit) {
  std::vector<std::vector<Triangle2>> triangles(groups.size());
  parallel_for(std::size_t{0}, groups.size(), [&](std::size_t i) {
    const auto in_plane = [&](const glm::dvec2& p) { return edge_m(groups[i].lift(p), i); };
    triangles[i] = mesh_plane(groups[i], outlines[i], in_plane, limit);
  });
  std::vector<Facet> facets;
  for (std::size_t i = 0; i < groups.size(); ++i)
    append_facets(triangles[i], groups[i], static_cast<std::uint32_t>(i), facets);
  return facets;
}

/// Interleaves the low ten bits of three coordinates.
std::uint32_t morton_code(const glm::dvec3& unit) {
  std::uint32_t code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto cell = static_cast<std::uint32_t>(std::clamp(unit[axis], 0.0, 1.0) * 1023.0);
    for (int bit = 0; bit < 10; ++bit)
      code |= (cell >> bit & 1u) << (3 * bit + axis);
  }
  return code;
}

/// Neighbours in space get neighbouring indices: blocks of facets are compact, which visibility tests use.
void sort_by_position(std::vector<Facet>& facets, const glm::dvec3& half_size) {
  const double extent = 2.0 * std::max({half_size.x, half_size.y, half_size.z});
  const auto key = [&](const Facet& p) {
    const glm::dvec3 middle = (p.corner[0] + p.corner[1] + p.corner[2]) / 3.0;
    return std::pair(p.plane, morton_code(middle / extent + 0.5));
  };
  std::ranges::stable_sort(facets, {}, key);
}

/// Of the faces as they are given, doubles included, m^2.
double total_area(const std::vector<PlaneGroup>& groups) {
  double sum = 0;
  for (const PlaneGroup& g : groups)
    for (const auto& t : g.triangles)
      sum += 0.5 * std::abs(cross(t[1] - t[0], t[2] - t[0]));
  return sum;
}

/// What the faces have more than the facets, where it is more than rounding.
double doubled_area(const std::vector<PlaneGroup>& groups, const std::vector<Facet>& facets) {
  constexpr double kRounding = 1e-5;
  const double faces = total_area(groups);
  double meshed = 0;
  for (const Facet& p : facets)
    meshed += p.area_m2;
  return faces - meshed > kRounding * faces ? faces - meshed : 0.0;
}

/// Facets that outlines and panes alone make, whatever the edge length.
std::size_t count_at_least(const std::vector<PlaneGroup>& groups, const std::vector<std::vector<Segment2>>& outlines,
                           const std::function<double(const glm::dvec3&, std::size_t, double)>& edge_within) {
  constexpr double kLong_m = 1e30;
  const auto edge_m = [&](const glm::dvec3& p, std::size_t group) { return edge_within(p, group, kLong_m); };
  return mesh_groups(groups, outlines, edge_m, std::numeric_limits<std::size_t>::max()).size();
}

/// Seeks the edge length of a wanted number of facets, which jumps where narrow faces are cut: between the longest that
/// gives more and the shortest that gives fewer.
class EdgeSearch {
public:
  /// After a mesh with this edge length has `ratio` of the wanted facets.
  double next(double edge_m, double ratio) {
    (ratio > 1.0 ? more_m_ : fewer_m_) = edge_m;
    const double step = edge_m * std::pow(ratio, ratio > 1.0 ? 0.6 : 0.45);
    return step > more_m_ && step < fewer_m_ ? step : std::sqrt(more_m_ * fewer_m_);
  }
  /// Where the wanted number lies in a jump: the longest that gives more.
  double finer(double edge_m, double ratio) {
    next(edge_m, ratio);
    return more_m_ > 0.0 ? more_m_ : fewer_m_;
  }

private:
  double more_m_ = 0.0, fewer_m_ = std::numeric_limits<double>::max();
};

Error too_fine() {
  return {ErrorCode::limit_exceeded, "more facets than the limit", "facet size", "use a larger --patch-size"};
}

/// How much longer edges beside panes are, so that they make kMostBesidePanes facets at most: N ~ 1 / edge^2.
/// `count_with`: facets for a factor; infinite: without panes.
template <class CountWith>
double lengthened_beside_panes(const CountWith& count_with) {
  const std::size_t without = count_with(std::numeric_limits<double>::infinity());
  double longer = 1.0;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const std::size_t with = count_with(longer);
    if (with <= without + kMostBesidePanes)
      break;
    longer *= std::sqrt(1.1 * static_cast<double>(with - without) / kMostBesidePanes);
  }
  return longer;
}

} // namespace

/// Edge length from N = 4.5 A / edge^2: what refinement makes of an area A; corrected by the count that results.
Result<SurfaceMesh> mesh_surfaces(const Room& room, const MeshOptions& options) {
  SurfaceMesh mesh;
  mesh.origin = room.bounds().centre();
  std::vector<PlaneGroup> groups = group_planes(room, mesh.origin);
  if (groups.empty())
    return Error{ErrorCode::geometry_invalid, "the room has no reflecting face", "room",
                 "give the walls a material whose name does not start with window"};
  if (const Result<void> cut = cut_slats(room, mesh.origin, groups); !cut)
    return cut.error();
  const double usual_m = std::sqrt(4.5 * total_area(groups) / options.target_facets);
  add_near_edges(groups, options.near_m, options.edge_m > 0 ? options.edge_m : usual_m);
  const glm::dvec3 size = room.bounds().size();
  const double tolerance_m = kSnapTolerance * std::max({size.x, size.y, size.z});
  std::vector<std::vector<Segment2>> outlines(groups.size());
  parallel_for(std::size_t{0}, groups.size(),
               [&](std::size_t i) { outlines[i] = find_outline(groups[i], tolerance_m); });
  mesh.planes = static_cast<std::uint32_t>(groups.size());

  const NearPanes panes(options.panes, mesh.origin, groups);
  const NearHoles holes(options.holes, groups);
  // A refined mesh has edges of about 0.7 of the bound; two or three corrections bring the count of those that
  // the edge length decides within 5 %.
  const double first_m = options.edge_m > 0 ? options.edge_m : usual_m;
  const auto within_with = [&](double longer) {
    return [&, longer](const glm::dvec3& p, std::size_t group, double longest_m) {
      const double beside_m = std::min(longer * panes.edge_m(p, group), holes.edge_m(p, groups[group].normal));
      return std::min(longest_m, beside_m) * options.field.at(p + mesh.origin);
    };
  };
  const auto count_with = [&](double longer) {
    const auto within = within_with(longer);
    return mesh_groups(
               groups, outlines, [&](const auto& p, std::size_t group) { return within(p, group, first_m); },
               4 * static_cast<std::size_t>(options.max_facets))
        .size();
  };
  const auto edge_within = within_with(panes.empty() ? 1.0 : lengthened_beside_panes(count_with));
  if (const std::size_t fixed = count_at_least(groups, outlines, edge_within); fixed >= kManyFixed)
    mesh.fixed_facets = fixed;
  const auto limit = static_cast<std::size_t>(options.max_facets);
  mesh.edge_m = options.edge_m > 0 ? options.edge_m : usual_m;
  const auto edge_m = [&](const glm::dvec3& p, std::size_t group) { return edge_within(p, group, mesh.edge_m); };
  if (options.edge_m > 0 && total_area(groups) / (0.5 * mesh.edge_m * mesh.edge_m) > options.max_facets)
    return too_fine();
  EdgeSearch search;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    mesh.facets = mesh_groups(groups, outlines, edge_m, 4 * limit);
    const std::size_t free = mesh.facets.size() - std::min(mesh.facets.size(), mesh.fixed_facets);
    const double ratio = static_cast<double>(std::max<std::size_t>(free, 1)) / options.target_facets;
    if (options.edge_m > 0 || (ratio > 0.95 && ratio < 1.05))
      break;
    const bool last = attempt + 2 >= kAttempts;
    mesh.edge_m = last ? search.finer(mesh.edge_m, ratio) : search.next(mesh.edge_m, ratio);
  }
  if (mesh.facets.size() > limit)
    return too_fine();
  sort_by_position(mesh.facets, 0.5 * size);
  mesh.doubled_m2 = doubled_area(groups, mesh.facets);
  return mesh;
}

} // namespace daylit::radiosity
