#pragma once

// First hits of many rays from one point: the room's whole faces are few where its facets are thousands. All rays are
// tried against one face after another, sixteen at a time, and a table of each plane says which facet lies where a
// face was met.

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "radiosity/detail/face_rays.h"
#include "radiosity/detail/plane_groups.h"
#include "radiosity/patches.h"
#include "radiosity/surface_mesh.h"
#include "scene/room/room.h"

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

/// Which facet lies where on a plane: a grid of cells over the facets of each plane.
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

/// Directions of rays, in an order in which neighbours are close together, with a cone around each kGroup of them.
struct RayGroups {
  static constexpr std::size_t kGroup = 64;
  struct Cone {
    glm::vec3 axis;
    float sine; ///< of its half angle; above 1 where that is more than a right angle
  };
  std::array<std::vector<float>, 3> direction;
  std::vector<Cone> cone;

  static RayGroups of(std::span<const glm::vec3> directions);
  std::size_t rays() const { return direction[0].size(); }
  /// Rays [first, first + count).
  RayComponents part(std::size_t first, std::size_t count) const {
    return {direction[0].data() + first, direction[1].data() + first, direction[2].data() + first, count};
  }
};

class WholeFaces {
public:
  static constexpr std::size_t kMostFaces = 512; ///< more are quicker found in a hierarchy of facets
  static constexpr std::int32_t kUnknown = FacetTable::kUnknown;

  /// `mesh`: of the same room, maybe cut further. Without faces when there are too many.
  static WholeFaces make(const Room& room, const SurfaceMesh& mesh, const PatchSet& set);

  bool empty() const { return face_.empty(); }

  /// Patch met by each ray from `point` (metres in the mesh's frame) when the rays are turned about z by an angle of
  /// this cosine and sine: -1 a side outside the problem, kUnknown where the tables do not tell (openings, joints).
  void trace(const glm::dvec3& point, const RayGroups& rays, const glm::dvec2& turn,
             std::span<std::int32_t> patch) const;

private:
  struct Face {
    std::array<glm::dvec3, 3> corner;
    std::uint32_t plane;
  };
  struct Nearest;
  /// Heights of a point over all planes, metres.
  std::vector<double> heights(const glm::dvec3& point) const;
  void find_nearest(const glm::dvec3& point, const RayGroups& rays, const glm::dvec2& turn,
                    std::span<const double> height_m, Nearest& out) const;
  bool on_facet(const PlaneViews& views, std::span<const double> height_m) const;

  std::vector<Face> face_;
  FacetTable table_;
  double least_height_m_ = 0; ///< of a point over a plane, to be told from one in it
};

} // namespace daylit::radiosity
