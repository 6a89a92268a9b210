#include "radiosity/detail/facet_table.h"

#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

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

} // namespace daylit::radiosity
