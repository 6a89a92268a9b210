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
constexpr double kBeside = 1e-3; ///< of a cell: rounding of what touches it

using Corners = std::array<glm::dvec2, 3>; ///< of a facet, in cells

/// Lays a grid of about kCellsPerFacet square cells per facet over the facets.
void cover(FacetTable::Plane& plane, const SurfaceMesh& mesh, std::span<const std::uint32_t> facets) {
  plane.cells_per_m = 1;
  glm::dvec2 low(std::numeric_limits<double>::infinity()), high(-low);
  for (const std::uint32_t f : facets)
    for (const glm::dvec3& c : mesh.facets[f].corner) {
      low = glm::min(low, plane.flat(c));
      high = glm::max(high, plane.flat(c));
    }
  const glm::dvec2 size = high - low;
  const double wanted = kCellsPerFacet * static_cast<double>(facets.size());
  plane.corner = low;
  plane.cells_per_m =
      std::min(std::sqrt(wanted / std::max(size.x * size.y, 1e-300)), wanted / std::max(size.x, size.y));
  plane.width = 1 + static_cast<std::int32_t>(size.x * plane.cells_per_m);
  plane.height = 1 + static_cast<std::int32_t>(size.y * plane.cells_per_m);
}

/// The edge e from a to b as the line n . (x - a) = 0 with n = (-e.y, e.x), positive inside the triangle.
FacetTile tile_of(const Corners& c, const std::array<std::int32_t, 2>& patch) {
  FacetTile tile{{}, patch};
  const double side = (c[1].x - c[0].x) * (c[2].y - c[0].y) < (c[1].y - c[0].y) * (c[2].x - c[0].x) ? -1.0 : 1.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec2 e = c[(k + 1) % 3] - c[k];
    tile.edge[k] = glm::vec3(side * glm::dvec3(-e.y, e.x, e.y * c[k].x - e.x * c[k].y));
  }
  return tile;
}

/// The corner of the cell that is farthest inside an edge lies inside it, for every edge.
bool touches_cell(const FacetTile& tile, int u, int v) {
  constexpr auto kBy = static_cast<float>(kBeside);
  return std::ranges::all_of(tile.edge, [&](const glm::vec3& e) {
    return e.x * (static_cast<float>(u) + (e.x > 0 ? 1.0f + kBy : -kBy)) +
               e.y * (static_cast<float>(v) + (e.y > 0 ? 1.0f + kBy : -kBy)) + e.z >=
           0.0f;
  });
}

/// Enters the tile of these corners in all cells that it touches.
void enter(const FacetTable::Plane& plane, const FacetTile& tile, const Corners& c, std::uint32_t id,
           std::vector<std::vector<std::uint32_t>>& tiles_of_cell) {
  const glm::dvec2 least = glm::min(glm::min(c[0], c[1]), c[2]) - kBeside,
                   most = glm::max(glm::max(c[0], c[1]), c[2]) + kBeside;
  for (int v = std::max(static_cast<int>(least.y), 0); v <= most.y && v < plane.height; ++v)
    for (int u = std::max(static_cast<int>(least.x), 0); u <= most.x && u < plane.width; ++u)
      if (touches_cell(tile, u, v))
        tiles_of_cell[static_cast<std::size_t>(v * plane.width + u)].push_back(id);
}

constexpr double kLeastHeight = 1e-6;  ///< of the room: a point nearer to a plane is in it
constexpr double kConeRounding = 1e-5; ///< of the sine of a cone

/// The face lies wholly beside the cone: some side of the pyramid over it is farther from the axis than the half angle.
bool outside(const SeenFace& f, const RayGroups::Cone& cone) {
  return glm::dot(f.edge[0], cone.axis) < -cone.sine || glm::dot(f.edge[1], cone.axis) < -cone.sine ||
         glm::dot(f.edge[2], cone.axis) < -cone.sine;
}

/// Directions in a frame that is turned with the rays.
struct Turn {
  double cosine, sine;
  glm::dvec3 back(const glm::dvec3& d) const { return {d.x * cosine + d.y * sine, d.y * cosine - d.x * sine, d.z}; }
};

/// The pyramid from the point over a triangle: its sides contain the point and an edge, with normals
/// (corner_k - point) x (corner_k+1 - point), turned inwards. A ray d reaches the plane at distance -height / (n . d).
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

PlaneViews views_of(std::span<const FacetTable::Plane> planes, const glm::dvec3& point, const Turn& turn) {
  PlaneViews views;
  for (const FacetTable::Plane& p : planes) {
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
  }
  return views;
}

} // namespace

glm::dvec2 FacetTable::Plane::flat(const glm::dvec3& p) const {
  return (glm::dvec2(glm::dot(p, axis_u), glm::dot(p, axis_v)) - corner) * cells_per_m;
}

FacetTable::FacetTable() : tile_{{{}, {kUnknown, kUnknown}}}, likely_{0}, first_{0, 0} {}

void FacetTable::add_plane(const PlaneGroup& group, const SurfaceMesh& mesh, const PatchSet& set,
                           std::span<const std::uint32_t> facets) {
  Plane plane{.normal = group.normal,
              .axis_u = group.axis_u,
              .axis_v = group.axis_v,
              .offset = glm::dot(group.point, group.normal),
              .first_cell = static_cast<std::int32_t>(likely_.size())};
  if (!facets.empty()) {
    cover(plane, mesh, facets);
    const auto width = static_cast<std::size_t>(plane.width);
    std::vector<std::vector<std::uint32_t>> tiles_of_cell(width * static_cast<std::size_t>(plane.height));
    for (const std::uint32_t f : facets) {
      const auto& corner = mesh.facets[f].corner;
      const Corners c{plane.flat(corner[0]), plane.flat(corner[1]), plane.flat(corner[2])};
      tile_.push_back(tile_of(c, set.of_facet[f]));
      enter(plane, tile_.back(), c, static_cast<std::uint32_t>(tile_.size() - 1), tiles_of_cell);
    }
    add_cells(tiles_of_cell, width);
  }
  plane_.push_back(plane);
}

void FacetTable::add_cells(const std::vector<std::vector<std::uint32_t>>& tiles_of_cell, std::size_t width) {
  for (std::size_t cell = 0; cell < tiles_of_cell.size(); ++cell) {
    const std::vector<std::uint32_t>& tiles = tiles_of_cell[cell];
    const float u = static_cast<float>(cell % width) + 0.5f, v = static_cast<float>(cell / width) + 0.5f;
    const auto middle = std::ranges::find_if(tiles, [&](std::uint32_t t) { return tile_[t].holds(u, v); });
    likely_.push_back(middle != tiles.end() ? *middle : tiles.empty() ? 0 : tiles.front());
    in_cell_.insert(in_cell_.end(), tiles.begin(), tiles.end());
    first_.push_back(static_cast<std::uint32_t>(in_cell_.size()));
  }
}

std::int32_t FacetTable::patch_at(std::int32_t cell, float u, float v, std::size_t side) const {
  const auto c = static_cast<std::size_t>(cell);
  for (std::size_t t = first_[c]; t < first_[c + 1]; ++t)
    if (tile_[in_cell_[t]].holds(u, v))
      return tile_[in_cell_[t]].patch[side];
  return kUnknown;
}

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
    const double sine = cosine > 0 ? std::sqrt(std::max(1.0 - cosine * cosine, 0.0)) + kConeRounding : 2.0;
    groups.cone.push_back({glm::vec3(axis), static_cast<float>(sine)});
  }
  return groups;
}

WholeFaces WholeFaces::make(const Room& room, const SurfaceMesh& mesh, const PatchSet& set) {
  WholeFaces faces;
  const std::vector<PlaneGroup> groups = group_planes(room, mesh.origin);
  std::size_t count = 0;
  for (const PlaneGroup& g : groups)
    count += g.triangles.size();
  if (count > kMostFaces)
    return faces;
  std::vector<std::vector<std::uint32_t>> of_plane(groups.size());
  for (std::uint32_t f = 0; f < mesh.facets.size(); ++f)
    of_plane[mesh.facets[f].plane].push_back(f);
  for (std::uint32_t k = 0; k < groups.size(); ++k) {
    faces.table_.add_plane(groups[k], mesh, set, of_plane[k]);
    for (const auto& t : groups[k].triangles)
      faces.face_.push_back({{groups[k].lift(t[0]), groups[k].lift(t[1]), groups[k].lift(t[2])}, k});
  }
  const glm::dvec3 size = room.bounds().size();
  faces.least_height_m_ = kLeastHeight * std::max({size.x, size.y, size.z});
  return faces;
}

/// What each ray met.
struct WholeFaces::Nearest {
  std::vector<float> nearness;     ///< 1 / distance, 0 nothing
  std::vector<std::int32_t> plane; ///< -1 none
};

std::vector<double> WholeFaces::heights(const glm::dvec3& point) const {
  std::vector<double> height_m;
  for (const FacetTable::Plane& p : table_.planes())
    height_m.push_back(glm::dot(point, p.normal) - p.offset);
  return height_m;
}

/// The point lies in a facet: its rays start on a surface, and the tables do not know on which side.
bool WholeFaces::on_facet(const PlaneViews& views, std::span<const double> height_m) const {
  for (std::size_t p = 0; p < height_m.size(); ++p) {
    const float u = views.start_u[p], v = views.start_v[p];
    if (std::abs(height_m[p]) < least_height_m_ && u > -1.0f && v > -1.0f && u < static_cast<float>(views.width[p]) &&
        v < static_cast<float>(views.height[p]) &&
        table_.patch_at(views.first_cell[p] + static_cast<int>(v) * views.width[p] + static_cast<int>(u), u, v, 0) !=
            kUnknown)
      return true;
  }
  return false;
}

void WholeFaces::find_nearest(const glm::dvec3& point, const RayGroups& rays, const glm::dvec2& turn,
                              std::span<const double> height_m, Nearest& out) const {
  for (const Face& face : face_) {
    if (std::abs(height_m[face.plane]) < least_height_m_) // edge on
      continue;
    const SeenFace s =
        seen(face.corner, point, table_.planes()[face.plane].normal, height_m[face.plane], {turn.x, turn.y});
    for (std::size_t g = 0; g < rays.cone.size(); ++g) {
      const std::size_t first = g * RayGroups::kGroup;
      if (!outside(s, rays.cone[g]))
        meet_face(s, rays.part(first, std::min(RayGroups::kGroup, rays.rays() - first)),
                  static_cast<std::int32_t>(face.plane), out.nearness.data() + first, out.plane.data() + first);
    }
  }
}

void WholeFaces::trace(const glm::dvec3& point, const RayGroups& rays, const glm::dvec2& turn,
                       std::span<std::int32_t> patch) const {
  const PlaneViews views = views_of(table_.planes(), point, {turn.x, turn.y});
  const std::vector<double> height_m = heights(point);
  if (on_facet(views, height_m)) {
    std::ranges::fill(patch, kUnknown);
    return;
  }
  const std::size_t count = rays.rays();
  Nearest nearest{std::vector<float>(count, 0.0f), std::vector<std::int32_t>(count, -1)};
  find_nearest(point, rays, turn, height_m, nearest);
  std::vector<float> u(count), v(count);
  std::vector<std::int32_t> cell(count);
  find_cells(views, rays.part(0, count), nearest.nearness.data(), nearest.plane.data(), u.data(), v.data(),
             cell.data());
  const auto side_of = [&](std::uint32_t ray) {
    return std::size_t{height_m[static_cast<std::size_t>(std::max(nearest.plane[ray], 0))] > 0.0 ? 0u : 1u};
  };
  // Most rays meet the tile at the middle of their cell: no branch for these.
  std::vector<std::uint32_t> others(count + 1);
  std::size_t more = 0;
  for (std::uint32_t k = 0; k < count; ++k) {
    const FacetTile& tile = table_.likely(cell[k]);
    patch[k] = tile.patch[side_of(k)];
    others[more] = k;
    more += tile.holds(u[k], v[k]) ? 0 : 1;
  }
  for (const std::uint32_t k : std::span(others).first(more))
    patch[k] = table_.patch_at(cell[k], u[k], v[k], side_of(k));
}

} // namespace daylit::radiosity
