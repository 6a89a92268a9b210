#pragma once

// First hits of many rays from one point: the room's whole faces are few where its facets are thousands. All rays are
// tried against one face after another, sixteen at a time, and a table of each plane says which facet lies where a
// face was met.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "radiosity/detail/face_rays.h"
#include "radiosity/detail/facet_table.h"
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
