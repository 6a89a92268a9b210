#pragma once

// The unknowns of the transport problem: facet sides that can exchange light with the air of the room.

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "radiosity/surface_mesh.h"
#include "scene/core/result.h"
#include "scene/room/aperture.h"
#include "scene/room/ray_scene.h"
#include "scene/room/room.h"

namespace daylit::radiosity {

/// One side of a facet. Corners counter-clockwise about the normal, metres relative to SurfaceMesh::origin.
struct Patch {
  std::array<glm::dvec3, 3> corner;
  glm::dvec3 normal{0.0};
  double area_m2 = 0;
  Rgb reflectance{0.0f};
  std::uint32_t facet = 0;
  float importance = 1; ///< SizeField::importance() of its light for the receivers
  glm::dvec3 middle() const { return (corner[0] + corner[1] + corner[2]) / 3.0; }
  /// Of the rays that a patch usually gets, 0 to 1.
  float worth() const { return std::min(importance, 1.0f); }
};

struct PatchSet {
  std::vector<Patch> patches;
  /// Index into patches of the front and the back of every facet, -1 where that side never meets the room's air.
  std::vector<std::array<std::int32_t, 2>> of_facet;
  std::size_t sides_skipped = 0;      ///< no light reaches them
  std::size_t sides_without_path = 0; ///< of those left out, lit but with no way for the light to any receiver

  /// Patch met by a ray in `direction` that hit `facet`; -1: a side outside the problem, black.
  std::int32_t hit(const SurfaceMesh& mesh, std::uint32_t facet, const glm::vec3& direction) const;
};

/// Ray scene over the facets themselves; hits report facet indices. Coordinates as in the mesh.
Result<RayScene> facet_scene(const SurfaceMesh& mesh);

/// Follows light from just inside the apertures: a facet side is kept when rays meet it from the air, or from a point
/// of a kept side at which light arrives, and rays beside them too (cracks one rounding wide lead nowhere). A side that
/// was not met looks for a kept one itself before it is given up, so that a small facet is not lost; what lies under
/// furniture, inside cushions that lie in each other or outdoors is. The result does not depend on the number of
/// threads. `receivers` (mesh frame): when there are any, only sides from which light can also get to one of them are
/// kept.
PatchSet find_patches(const Room& room, const SurfaceMesh& mesh, const RayScene& scene,
                      const std::vector<Aperture>& apertures, std::span<const glm::dvec3> receivers = {});

} // namespace daylit::radiosity
