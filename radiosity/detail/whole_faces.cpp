#include "radiosity/detail/whole_faces.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "radiosity/detail/plane_groups.h"

namespace daylit::radiosity {

namespace {

constexpr double kCellsPerPatch = 16;
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

void WholeFaces::fill(const PatchMesh& patches, const ElementSet& set, std::span<const std::uint32_t> of_plane,
                      Plane& plane) {
  if (of_plane.empty())
    return;
  const auto flat = [&](const glm::dvec3& p) {
    return glm::dvec2(glm::dot(p, plane.axis_u), glm::dot(p, plane.axis_v));
  };
  glm::dvec2 low(std::numeric_limits<double>::infinity()), high(-low);
  for (const std::uint32_t p : of_plane)
    for (const glm::dvec3& c : patches.patches[p].corner) {
      low = glm::min(low, flat(c));
      high = glm::max(high, flat(c));
    }
  const glm::dvec2 size = high - low;
  const double wanted = kCellsPerPatch * static_cast<double>(of_plane.size()), longest = std::max(size.x, size.y);
  plane.cells_per_m = std::min(std::sqrt(wanted / std::max(size.x * size.y, 1e-300)), wanted / longest);
  plane.corner = low;
  for (int axis = 0; axis < 2; ++axis)
    plane.cells[static_cast<std::size_t>(axis)] = 1 + static_cast<std::int32_t>(size[axis] * plane.cells_per_m);
  std::vector<std::vector<std::uint32_t>> of_cell(static_cast<std::size_t>(plane.cells[0]) *
                                         static_cast<std::size_t>(plane.cells[1]));
  for (const std::uint32_t p : of_plane) {
    // In units of cells.
    std::array<glm::dvec2, 3> c;
    for (std::size_t k = 0; k < 3; ++k)
      c[k] = (flat(patches.patches[p].corner[k]) - low) * plane.cells_per_m;
    Tile tile{{}, set.of_patch[p]};
    const double side = (c[1].x - c[0].x) * (c[2].y - c[0].y) < (c[1].y - c[0].y) * (c[2].x - c[0].x) ? -1.0 : 1.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec2 e = c[(k + 1) % 3] - c[k];
      tile.edge[k] = glm::vec3(side * glm::dvec3(-e.y, e.x, e.y * c[k].x - e.x * c[k].y));
    }
    const auto range = [&](int axis) {
      const auto [least, most] = std::minmax({c[0][axis], c[1][axis], c[2][axis]});
      const int last = plane.cells[static_cast<std::size_t>(axis)] - 1;
      return std::array{std::clamp(static_cast<int>(least - 1e-3), 0, last),
                        std::clamp(static_cast<int>(most + 1e-3), 0, last)};
    };
    const auto [x0, x1] = range(0);
    const auto [y0, y1] = range(1);
    for (int y = y0; y <= y1; ++y)
      for (int x = x0; x <= x1; ++x) {
        // The corner of the cell that is farthest inside each edge.
        const bool touched = std::ranges::all_of(tile.edge, [&](const glm::vec3& e) {
          const float u = static_cast<float>(x) + (e.x > 0 ? 1.001f : -0.001f),
                      v = static_cast<float>(y) + (e.y > 0 ? 1.001f : -0.001f);
          return e.x * u + e.y * v + e.z >= 0.0f;
        });
        if (touched)
          of_cell[static_cast<std::size_t>(y) * static_cast<std::size_t>(plane.cells[0]) + static_cast<std::size_t>(x)]
              .push_back(static_cast<std::uint32_t>(plane.tile.size()));
      }
    plane.tile.push_back(tile);
  }
  for (const std::vector<std::uint32_t>& cell : of_cell) {
    plane.first.push_back(static_cast<std::uint32_t>(plane.in_cell.size()));
    plane.in_cell.insert(plane.in_cell.end(), cell.begin(), cell.end());
  }
  plane.first.push_back(static_cast<std::uint32_t>(plane.in_cell.size()));
}

WholeFaces WholeFaces::make(const Room& room, const PatchMesh& patches, const ElementSet& set) {
  WholeFaces faces;
  const std::vector<PlaneGroup> groups = group_planes(room, patches.origin);
  std::size_t count = 0;
  for (const PlaneGroup& g : groups)
    count += g.triangles.size();
  if (count > kMostFaces)
    return faces;
  std::vector<std::vector<std::uint32_t>> of_plane(groups.size());
  for (std::uint32_t p = 0; p < patches.patches.size(); ++p)
    of_plane[patches.patches[p].plane].push_back(p);
  for (std::uint32_t k = 0; k < groups.size(); ++k) {
    const PlaneGroup& g = groups[k];
    Plane plane;
    plane.normal = g.normal;
    plane.axis_u = g.axis_u;
    plane.axis_v = g.axis_v;
    plane.offset = glm::dot(g.point, g.normal);
    fill(patches, set, of_plane[k], plane);
    faces.plane_.push_back(std::move(plane));
    for (const auto& t : g.triangles)
      faces.face_.push_back({{g.lift(t[0]), g.lift(t[1]), g.lift(t[2])}, k});
  }
  const glm::dvec3 size = room.bounds().size();
  faces.least_height_m_ = kLeastHeight * std::max({size.x, size.y, size.z});
  return faces;
}

/// A plane's table as rays from one point meet it: in cells, (start + d * along / nearness).
struct WholeFaces::View {
  const Plane* plane;
  glm::vec3 along_u, along_v;
  float u, v;
  int side;
  bool in_plane; ///< the point is

  bool on_patch() const { return in_plane && element(glm::vec3(0.0f), 0.0f) != kUnknown; }
  std::int32_t element(const glm::vec3& d, float distance) const {
    const float x = u + distance * glm::dot(along_u, d), y = v + distance * glm::dot(along_v, d);
    if (plane->tile.empty() || !(x > -1.0f && y > -1.0f))
      return kUnknown;
    const int cx = std::max(static_cast<int>(x), 0), cy = std::max(static_cast<int>(y), 0);
    if (cx >= plane->cells[0] || cy >= plane->cells[1])
      return kUnknown;
    const auto cell = static_cast<std::size_t>(cy * plane->cells[0] + cx);
    for (std::size_t t = plane->first[cell]; t < plane->first[cell + 1]; ++t) {
      const Tile& tile = plane->tile[plane->in_cell[t]];
      const auto inside = [&](std::size_t k) { return tile.edge[k].x * x + tile.edge[k].y * y + tile.edge[k].z; };
      if (std::min(std::min(inside(0), inside(1)), inside(2)) >= 0.0f)
        return tile.element[static_cast<std::size_t>(side)];
    }
    return kUnknown;
  }
};

void WholeFaces::trace(const glm::dvec3& point, const RayGroups& rays, const glm::dvec2& turn_of_rays,
                       std::span<std::int32_t> element) const {
  const Turn turn{turn_of_rays.x, turn_of_rays.y};
  std::vector<float> nearest(rays.rays(), 0.0f);
  std::ranges::fill(element, kUnknown);
  std::vector<View> view;
  std::vector<double> height_m;
  for (const Plane& p : plane_) {
    height_m.push_back(glm::dot(point, p.normal) - p.offset);
    const glm::dvec2 start =
        p.cells_per_m * (glm::dvec2(glm::dot(point, p.axis_u), glm::dot(point, p.axis_v)) - p.corner);
    view.push_back({&p, glm::vec3(turn.back(p.cells_per_m * p.axis_u)), glm::vec3(turn.back(p.cells_per_m * p.axis_v)),
                    static_cast<float>(start.x), static_cast<float>(start.y), height_m.back() > 0.0 ? 0 : 1,
                    std::abs(height_m.back()) < least_height_m_});
  }
  if (std::ranges::any_of(view, &View::on_patch))
    return;
  std::vector<std::int32_t> met(rays.rays(), -1);
  for (std::size_t f = 0; f < face_.size(); ++f) {
    const std::uint32_t plane = face_[f].plane;
    if (view[plane].in_plane) // edge on
      continue;
    const SeenFace s = seen(face_[f].corner, point, plane_[plane].normal, height_m[plane], turn);
    for (std::size_t g = 0; g < rays.cone.size(); ++g) {
      if (outside(s, rays.cone[g]))
        continue;
      const std::size_t first = g * RayGroups::kGroup, count = std::min(RayGroups::kGroup, rays.rays() - first);
      meet(s, rays.direction[0].data() + first, rays.direction[1].data() + first, rays.direction[2].data() + first,
           count, static_cast<std::int32_t>(plane), nearest.data() + first, met.data() + first);
    }
  }
  for (std::size_t k = 0; k < rays.rays(); ++k)
    if (met[k] >= 0)
      element[k] = view[static_cast<std::size_t>(met[k])].element(
          {rays.direction[0][k], rays.direction[1][k], rays.direction[2][k]}, 1.0f / nearest[k]);
}

} // namespace daylit::radiosity
