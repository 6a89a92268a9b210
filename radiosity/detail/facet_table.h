#pragma once

// Which facet lies where on a plane: a grid of cells over the facets of each plane.

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "radiosity/detail/plane_groups.h"
#include "radiosity/patches.h"
#include "radiosity/surface_mesh.h"

namespace daylit::radiosity {

/// A facet in its plane, in cells: inside where all of edge.x u + edge.y v + edge.z are >= 0.
struct FacetTile {
  std::array<glm::vec3, 3> edge;
  std::array<std::int32_t, 2> patch; ///< in front and at the back

  bool holds(float u, float v) const {
    const auto inside = [&](std::size_t k) { return edge[k].x * u + edge[k].y * v + edge[k].z; };
    return std::min(std::min(inside(0), inside(1)), inside(2)) >= 0.0f;
  }
};

class FacetTable {
public:
  static constexpr std::int32_t kUnknown = -2;

  struct Plane {
    glm::dvec3 normal{0.0}, axis_u{0.0}, axis_v{0.0};
    double offset = 0;      ///< of its points along the normal, metres
    glm::dvec2 corner{0.0}; ///< of its cells, metres in (u, v)
    double cells_per_m = 0;
    std::int32_t width = 0, height = 0;
    std::int32_t first_cell = 0;

    glm::dvec2 flat(const glm::dvec3& p) const; ///< in cells
  };

  FacetTable();
  /// `facets`: those of the mesh that lie in the plane.
  void add_plane(const PlaneGroup& group, const SurfaceMesh& mesh, const PatchSet& set,
                 std::span<const std::uint32_t> facets);

  const std::vector<Plane>& planes() const { return plane_; }
  /// The facet at the middle of a cell; cell 0 is nowhere, its tile holds every point and knows no patch.
  const FacetTile& likely(std::int32_t cell) const { return tile_[likely_[static_cast<std::size_t>(cell)]]; }
  /// Patch at (u, v) of a cell, side 0 in front of the plane; kUnknown in joints and openings.
  std::int32_t patch_at(std::int32_t cell, float u, float v, std::size_t side) const;

private:
  void add_cells(const std::vector<std::vector<std::uint32_t>>& tiles_of_cell, std::size_t width);

  std::vector<Plane> plane_;
  std::vector<FacetTile> tile_;
  // Of the cells of all planes, after one that is nowhere.
  std::vector<std::uint32_t> likely_;          ///< tile at its middle
  std::vector<std::uint32_t> first_, in_cell_; ///< tiles that touch it, in_cell_[first_[cell]] and on
};

} // namespace daylit::radiosity
