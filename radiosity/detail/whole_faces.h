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

#include "radiosity/patches.h"
#include "radiosity/surface_mesh.h"
#include "scene/room/room.h"

namespace daylit::radiosity {

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
};

class WholeFaces {
public:
  static constexpr std::size_t kMostFaces = 512; ///< more are quicker found in a hierarchy of facets
  static constexpr std::int32_t kUnknown = -2;

  /// `facets`: of the same room, maybe cut further. Without faces when there are too many.
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
  /// A facet in its plane, in cells: inside where all of edge.x u + edge.y v + edge.z are >= 0.
  struct Tile {
    std::array<glm::vec3, 3> edge;
    std::array<std::int32_t, 2> patch; ///< in front and at the back

    bool holds(float u, float v) const {
      const auto inside = [&](std::size_t k) { return edge[k].x * u + edge[k].y * v + edge[k].z; };
      return std::min(std::min(inside(0), inside(1)), inside(2)) >= 0.0f;
    }
    bool touches_cell(int u, int v) const;
  };
  struct Plane {
    glm::dvec3 normal{0.0}, axis_u{0.0}, axis_v{0.0};
    double offset = 0;      ///< of its points along the normal, metres
    glm::dvec2 corner{0.0}; ///< of its cells, metres in (u, v)
    double cells_per_m = 0;
    std::int32_t width = 0, height = 0;
    std::int32_t first_cell = 0;

    glm::dvec2 flat(const glm::dvec3& p) const; ///< in cells
    void cover(const SurfaceMesh& mesh, std::span<const std::uint32_t> of_plane);
    /// A tile of these corners, in all cells that it touches.
    void list(const Tile& tile, const std::array<glm::dvec2, 3>& corners, std::uint32_t number,
              std::vector<std::vector<std::uint32_t>>& of_cell) const;
  };
  struct Views;
  struct Nearest;
  void add_cells(const SurfaceMesh& mesh, const PatchSet& set, std::span<const std::uint32_t> of_plane, Plane& plane);
  Views views(const glm::dvec3& point, const glm::dvec2& turn) const;
  void find_nearest(const glm::dvec3& point, const RayGroups& rays, const glm::dvec2& turn, const Views& views,
                    Nearest& out) const;
  bool on_facet(const Views& views) const;
  std::int32_t patch_at(std::int32_t cell, float u, float v, std::size_t side) const;

  std::vector<Face> face_;
  std::vector<Plane> plane_;
  std::vector<Tile> tile_; ///< the first holds every place and does not know
  // Of the cells of all planes, after one that is nowhere.
  std::vector<std::uint32_t> likely_;          ///< tile at its middle
  std::vector<std::uint32_t> first_, in_cell_; ///< tiles that touch it, in_cell_[first_[cell]] and on
  double least_height_m_ = 0;                  ///< of a point over a plane, to be told from one in it
};

} // namespace daylit::radiosity
