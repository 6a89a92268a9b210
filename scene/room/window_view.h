#pragma once

// What a surface element sees through the windows and holes of a room: the set of directions along which daylight
// arrives there without a reflection, cut out exactly.

#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/room/ray_scene.h"
#include "scene/room/room.h"

namespace daylit {

/// A small convex part of the visible sky.
struct SkyCell {
  glm::dvec3 direction; ///< unit, near its middle
  /// Integral of the cosine to the normal over the cell, times the transmittance of every pane on the way there, at the
  /// angle of `direction`; steradian. The cosine is integrated exactly.
  glm::dvec3 weight;
};

/// The cone of every aperture is cut at the surface's own plane and at the horizon, where skies end; what the triangles
/// of the room hide is cut away, plane by plane; light counts at the aperture through which it enters first. Where more
/// than a few triangles cut a part, it is halved; parts too small to matter are decided by one ray.
/// Keeps references: the room, the apertures and the ray scene must outlive it. Made for one point; const calls are
/// thread-safe.
class WindowView {
public:
  WindowView(const Room& room, const std::vector<Aperture>& apertures, const RayScene& scene, const glm::dvec3& point,
             const glm::dvec3& unit_normal);

  /// Cells of at most `largest_sr` that cover what is visible.
  std::vector<SkyCell> cells(double largest_sr) const;
  /// The visible part of a small convex cone of directions (a sun, a texel), one cell per part. Corners are unit
  /// vectors, counter-clockwise as seen from the point.
  std::vector<SkyCell> cells_within(const std::vector<glm::dvec3>& cone) const;

private:
  using Cone = std::vector<glm::dvec3>;
  struct Work;
  const std::vector<Aperture>& apertures_;
  const RayScene& scene_;
  glm::dvec3 eye_, normal_;
  std::vector<Cone> aperture_; ///< as seen from the eye; empty: edge-on
  std::vector<Cone> hiding_;   ///< triangles in front of the surface that overlap an aperture

  void see_triangles(const Room& room);
  void open_part(std::size_t aperture, Cone cone, Work& work) const;
  void cut_by_triangles(Cone cone, std::vector<std::uint32_t> triangles, Work& work) const;
  void cut_by_apertures(std::size_t aperture, Work& work) const;
  void add_cell(std::span<const glm::dvec3> cone, Work& work) const;
  void add_cells(const Cone& part, double largest_sr, Work& work) const;
};

} // namespace daylit
