#include "radiosity/detail/whole_faces.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "radiosity/detail/plane_groups.h"

namespace daylit::radiosity {

namespace {

constexpr double kCellsPerFacet = 16;
constexpr double kLeastHeight = 1e-6; ///< of the room: a point nearer to a plane is in it

/// One face seen from a point: a ray d passes inside where all of edge * d are >= 0, at 1 / (nearness * d).
struct SeenFace {
  std::array<glm::vec3, 3> edge; ///< unit, of the planes through the point and an edge
  glm::vec3 nearness;
};

/// Plain loops that become vectors of any width.
__attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4"))) void
meet(const SeenFace& f, const float* x, const float* y, const float* z, std::size_t rays, std::int32_t number,
     float* nearest, std::int32_t* face) {
  const glm::vec3 a = f.edge[0], b = f.edge[1], c = f.edge[2], n = f.nearness;
  for (std::size_t k = 0; k < rays; ++k) {
    const float in_a = a.x * x[k] + a.y * y[k] + a.z * z[k], in_b = b.x * x[k] + b.y * y[k] + b.z * z[k],
                in_c = c.x * x[k] + c.y * y[k] + c.z * z[k], near = n.x * x[k] + n.y * y[k] + n.z * z[k];
    const bool met = (std::min(std::min(in_a, in_b), in_c) >= 0.0f) & (near > nearest[k]);
    nearest[k] = met ? near : nearest[k];
    face[k] = met ? number : face[k];
  }
}

bool outside(const SeenFace& f, const RayGroups::Cone& cone) {
  return glm::dot(f.edge[0], cone.axis) < -cone.sine || glm::dot(f.edge[1], cone.axis) < -cone.sine ||
         glm::dot(f.edge[2], cone.axis) < -cone.sine;
}

/// Directions in a frame that is turned with the rays.
struct Turn {
  double cosine, sine;
  glm::dvec3 back(const glm::dvec3& d) const { return {d.x * cosine + d.y * sine, d.y * cosine - d.x * sine, d.z}; }
};

SeenFace seen(const std::array<glm::dvec3, 3>& corner, const glm::dvec3& point, const glm::dvec3& normal,
              double height_m, const Turn& turn) {
  SeenFace f;
  const std::array<glm::dvec3, 3> way{corner[0] - point, corner[1] - point, corner[2] - point};
  const double side = glm::dot(glm::cross(way[0], way[1]), way[2]) < 0.0 ? -1.0 : 1.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec3 edge = glm::cross(way[k], way[(k + 1) % 3]);
    f.edge[k] = glm::vec3(turn.back(edge * (side / std::max(glm::length(edge), 1e-300))));
  }
  f.nearness = glm::vec3(turn.back(normal / -height_m));
  return f;
}

} // namespace

RayGroups RayGroups::of(std::span<const glm::vec3> directions) {
  RayGroups groups;
  for (const glm::vec3& d : directions)
    for (int axis = 0; axis < 3; ++axis)
      groups.direction[static_cast<std::size_t>(axis)].push_back(d[axis]);
  for (std::size_t first = 0; first < directions.size(); first += kGroup) {
    const auto group = directions.subspan(first, std::min(kGroup, directions.size() - first));
    glm::dvec3 sum(0.0);
    for (const glm::vec3& d : group)
      sum += glm::dvec3(d);
    const glm::dvec3 axis = sum / std::max(glm::length(sum), 1e-300);
    double cosine = 1;
    for (const glm::vec3& d : group)
      cosine = std::min(cosine, glm::dot(axis, glm::dvec3(d)));
    constexpr double kRounding = 1e-5;
    groups.cone.push_back(
        {glm::vec3(axis),
         static_cast<float>(cosine > 0 ? std::sqrt(std::max(1.0 - cosine * cosine, 0.0)) + kRounding : 2.0)});
  }
  return groups;
}

bool WholeFaces::Tile::touches_cell(int u, int v) const {
  constexpr float kBeside = 1e-3f;
  // The corner of the cell that is farthest inside each edge.
  return std::ranges::all_of(edge, [&](const glm::vec3& e) {
    return e.x * (static_cast<float>(u) + (e.x > 0 ? 1.0f + kBeside : -kBeside)) +
               e.y * (static_cast<float>(v) + (e.y > 0 ? 1.0f + kBeside : -kBeside)) + e.z >=
           0.0f;
  });
}

glm::dvec2 WholeFaces::Plane::flat(const glm::dvec3& p) const {
  return (glm::dvec2(glm::dot(p, axis_u), glm::dot(p, axis_v)) - corner) * cells_per_m;
}

void WholeFaces::Plane::cover(const SurfaceMesh& mesh, std::span<const std::uint32_t> of_plane) {
  cells_per_m = 1;
  glm::dvec2 low(std::numeric_limits<double>::infinity()), high(-low);
  for (const std::uint32_t p : of_plane)
    for (const glm::dvec3& c : mesh.facets[p].corner) {
      low = glm::min(low, flat(c));
      high = glm::max(high, flat(c));
    }
  const glm::dvec2 size = high - low;
  const double wanted = kCellsPerFacet * static_cast<double>(of_plane.size());
  corner = low;
  cells_per_m = std::min(std::sqrt(wanted / std::max(size.x * size.y, 1e-300)), wanted / std::max(size.x, size.y));
  width = 1 + static_cast<std::int32_t>(size.x * cells_per_m);
  height = 1 + static_cast<std::int32_t>(size.y * cells_per_m);
}

void WholeFaces::Plane::list(const Tile& tile, const std::array<glm::dvec2, 3>& c, std::uint32_t number,
                             std::vector<std::vector<std::uint32_t>>& of_cell) const {
  constexpr double kBeside = 1e-3;
  const glm::dvec2 least = glm::min(glm::min(c[0], c[1]), c[2]) - kBeside,
                   most = glm::max(glm::max(c[0], c[1]), c[2]) + kBeside;
  for (int v = std::max(static_cast<int>(least.y), 0); v <= most.y && v < height; ++v)
    for (int u = std::max(static_cast<int>(least.x), 0); u <= most.x && u < width; ++u)
      if (tile.touches_cell(u, v))
        of_cell[static_cast<std::size_t>(v * width + u)].push_back(number);
}

void WholeFaces::add_cells(const SurfaceMesh& mesh, const PatchSet& set, std::span<const std::uint32_t> of_plane,
                           Plane& plane) {
  plane.first_cell = static_cast<std::int32_t>(likely_.size());
  if (of_plane.empty())
    return;
  plane.cover(mesh, of_plane);
  const auto width = static_cast<std::size_t>(plane.width);
  std::vector<std::vector<std::uint32_t>> of_cell(width * static_cast<std::size_t>(plane.height));
  for (const std::uint32_t p : of_plane) {
    std::array<glm::dvec2, 3> c;
    for (std::size_t k = 0; k < 3; ++k)
      c[k] = plane.flat(mesh.facets[p].corner[k]);
    Tile tile{{}, set.of_facet[p]};
    const double side = (c[1].x - c[0].x) * (c[2].y - c[0].y) < (c[1].y - c[0].y) * (c[2].x - c[0].x) ? -1.0 : 1.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec2 e = c[(k + 1) % 3] - c[k];
      tile.edge[k] = glm::vec3(side * glm::dvec3(-e.y, e.x, e.y * c[k].x - e.x * c[k].y));
    }
    plane.list(tile, c, static_cast<std::uint32_t>(tile_.size()), of_cell);
    tile_.push_back(tile);
  }
  for (std::size_t cell = 0; cell < of_cell.size(); ++cell) {
    const std::vector<std::uint32_t>& tiles = of_cell[cell];
    const float u = static_cast<float>(cell % width) + 0.5f, v = static_cast<float>(cell / width) + 0.5f;
    const auto middle = std::ranges::find_if(tiles, [&](std::uint32_t t) { return tile_[t].holds(u, v); });
    likely_.push_back(middle != tiles.end() ? *middle : tiles.empty() ? 0 : tiles.front());
    in_cell_.insert(in_cell_.end(), tiles.begin(), tiles.end());
    first_.push_back(static_cast<std::uint32_t>(in_cell_.size()));
  }
}

WholeFaces WholeFaces::make(const Room& room, const SurfaceMesh& mesh, const PatchSet& set) {
  WholeFaces faces;
  const std::vector<PlaneGroup> groups = group_planes(room, mesh.origin);
  std::size_t count = 0;
  for (const PlaneGroup& g : groups)
    count += g.triangles.size();
  if (count > kMostFaces)
    return faces;
  faces.tile_.push_back({{}, {kUnknown, kUnknown}});
  faces.likely_ = {0};
  faces.first_ = {0, 0};
  std::vector<std::vector<std::uint32_t>> of_plane(groups.size());
  for (std::uint32_t p = 0; p < mesh.facets.size(); ++p)
    of_plane[mesh.facets[p].plane].push_back(p);
  for (std::uint32_t k = 0; k < groups.size(); ++k) {
    const PlaneGroup& g = groups[k];
    Plane plane;
    plane.normal = g.normal;
    plane.axis_u = g.axis_u;
    plane.axis_v = g.axis_v;
    plane.offset = glm::dot(g.point, g.normal);
    faces.add_cells(mesh, set, of_plane[k], plane);
    faces.plane_.push_back(plane);
    for (const auto& t : g.triangles)
      faces.face_.push_back({{g.lift(t[0]), g.lift(t[1]), g.lift(t[2])}, k});
  }
  const glm::dvec3 size = room.bounds().size();
  faces.least_height_m_ = kLeastHeight * std::max({size.x, size.y, size.z});
  return faces;
}

namespace {

struct PlaneArrays {
  std::array<const float*, 3> along_u, along_v;
  const float *start_u, *start_v;
  const std::int32_t *width, *height, *first_cell;
};

/// Where rays meet their planes and in which cell that is; cell 0 where no face is met.
__attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4"))) void
find_places(const PlaneArrays& p, const float* x, const float* y, const float* z, const float* nearness,
            const std::int32_t* plane, std::size_t rays, float* __restrict u, float* __restrict v,
            std::int32_t* __restrict cell) {
  for (std::size_t k = 0; k < rays; ++k) {
    const std::int32_t i = plane[k] < 0 ? 0 : plane[k];
    const float distance = plane[k] < 0 ? 0.0f : 1.0f / nearness[k];
    u[k] = p.start_u[i] + distance * (p.along_u[0][i] * x[k] + p.along_u[1][i] * y[k] + p.along_u[2][i] * z[k]);
    v[k] = p.start_v[i] + distance * (p.along_v[0][i] * x[k] + p.along_v[1][i] * y[k] + p.along_v[2][i] * z[k]);
    const auto cu = static_cast<std::int32_t>(u[k]), cv = static_cast<std::int32_t>(v[k]);
    const bool known = (plane[k] >= 0) & (u[k] > -1.0f) & (v[k] > -1.0f) & (cu < p.width[i]) & (cv < p.height[i]);
    cell[k] = known ? p.first_cell[i] + cv * p.width[i] + cu : 0;
  }
}

} // namespace

/// The planes as rays from one point meet them, in cells: a ray d is at start + d * along / nearness.
struct WholeFaces::Views {
  std::array<std::vector<float>, 3> along_u, along_v;
  std::vector<float> start_u, start_v;
  std::vector<std::int32_t> width, height, first_cell;
  std::vector<std::int32_t> side;
  std::vector<double> height_m;

  PlaneArrays arrays() const {
    return {{along_u[0].data(), along_u[1].data(), along_u[2].data()},
            {along_v[0].data(), along_v[1].data(), along_v[2].data()},
            start_u.data(),
            start_v.data(),
            width.data(),
            height.data(),
            first_cell.data()};
  }
};

/// What each ray met.
struct WholeFaces::Nearest {
  std::vector<float> nearness;     ///< 1 / distance, 0 nothing
  std::vector<std::int32_t> plane; ///< -1 none
};

WholeFaces::Views WholeFaces::views(const glm::dvec3& point, const glm::dvec2& turn_of_rays) const {
  const Turn turn{turn_of_rays.x, turn_of_rays.y};
  Views views;
  for (const Plane& p : plane_) {
    const glm::dvec3 u = turn.back(p.cells_per_m * p.axis_u), v = turn.back(p.cells_per_m * p.axis_v);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      views.along_u[axis].push_back(static_cast<float>(u[static_cast<int>(axis)]));
      views.along_v[axis].push_back(static_cast<float>(v[static_cast<int>(axis)]));
    }
    const glm::dvec2 start = p.flat(point);
    views.start_u.push_back(static_cast<float>(start.x));
    views.start_v.push_back(static_cast<float>(start.y));
    views.width.push_back(p.width);
    views.height.push_back(p.height);
    views.first_cell.push_back(p.first_cell);
    views.height_m.push_back(glm::dot(point, p.normal) - p.offset);
    views.side.push_back(views.height_m.back() > 0.0 ? 0 : 1);
  }
  return views;
}

std::int32_t WholeFaces::patch_at(std::int32_t cell, float u, float v, std::size_t side) const {
  const auto c = static_cast<std::size_t>(cell);
  for (std::size_t t = first_[c]; t < first_[c + 1]; ++t)
    if (tile_[in_cell_[t]].holds(u, v))
      return tile_[in_cell_[t]].patch[side];
  return kUnknown;
}

bool WholeFaces::on_facet(const Views& views) const {
  for (std::size_t p = 0; p < plane_.size(); ++p) {
    const float u = views.start_u[p], v = views.start_v[p];
    if (std::abs(views.height_m[p]) < least_height_m_ && u > -1.0f && v > -1.0f &&
        u < static_cast<float>(plane_[p].width) && v < static_cast<float>(plane_[p].height) &&
        patch_at(plane_[p].first_cell + static_cast<int>(v) * plane_[p].width + static_cast<int>(u), u, v, 0) !=
            kUnknown)
      return true;
  }
  return false;
}

void WholeFaces::find_nearest(const glm::dvec3& point, const RayGroups& rays, const glm::dvec2& turn,
                              const Views& views, Nearest& out) const {
  for (const Face& face : face_) {
    const double height_m = views.height_m[face.plane];
    if (std::abs(height_m) < least_height_m_) // edge on
      continue;
    const SeenFace s = seen(face.corner, point, plane_[face.plane].normal, height_m, {turn.x, turn.y});
    for (std::size_t g = 0; g < rays.cone.size(); ++g) {
      const std::size_t first = g * RayGroups::kGroup;
      if (!outside(s, rays.cone[g]))
        meet(s, rays.direction[0].data() + first, rays.direction[1].data() + first, rays.direction[2].data() + first,
             std::min(RayGroups::kGroup, rays.rays() - first), static_cast<std::int32_t>(face.plane),
             out.nearness.data() + first, out.plane.data() + first);
    }
  }
}

void WholeFaces::trace(const glm::dvec3& point, const RayGroups& rays, const glm::dvec2& turn,
                       std::span<std::int32_t> patch) const {
  const Views views = this->views(point, turn);
  if (on_facet(views)) {
    std::ranges::fill(patch, kUnknown);
    return;
  }
  const std::size_t count = rays.rays();
  Nearest nearest{std::vector<float>(count, 0.0f), std::vector<std::int32_t>(count, -1)};
  find_nearest(point, rays, turn, views, nearest);
  std::vector<float> u(count), v(count);
  std::vector<std::int32_t> cell(count);
  find_places(views.arrays(), rays.direction[0].data(), rays.direction[1].data(), rays.direction[2].data(),
              nearest.nearness.data(), nearest.plane.data(), count, u.data(), v.data(), cell.data());
  const auto side_of = [&](std::uint32_t ray) {
    return static_cast<std::size_t>(views.side[static_cast<std::size_t>(std::max(nearest.plane[ray], 0))]);
  };
  // Most rays meet the tile at the middle of their cell: no branch for these.
  std::vector<std::uint32_t> others(count + 1);
  std::size_t more = 0;
  for (std::uint32_t k = 0; k < count; ++k) {
    const Tile& tile = tile_[likely_[static_cast<std::size_t>(cell[k])]];
    patch[k] = tile.patch[side_of(k)];
    others[more] = k;
    more += tile.holds(u[k], v[k]) ? 0 : 1;
  }
  for (const std::uint32_t k : std::span(others).first(more))
    patch[k] = patch_at(cell[k], u[k], v[k], side_of(k));
}

} // namespace daylit::radiosity
