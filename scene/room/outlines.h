#pragma once

// Outlines of openings in a triangle soup: where surfaces end (holes) and where panes end (windows).

#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/room/room.h"

namespace daylit::detail {

/// Corners around a planar opening, counter-clockwise about `normal`.
struct Outline {
  std::vector<glm::dvec3> corners;
  glm::dvec3 normal{0.0}; ///< unit
};

struct HoleOutlines {
  std::vector<Outline> outlines;
  bool complete = true; ///< false: so many open edges that some were not followed
};

/// Candidates for plain holes: planar loops of edges. The borders are
enum class BorderKind {
  open,   ///< edges with surface on one side only (an odd number of triangles), T-junctions resolved
  crease, ///< open edges, and edges where the surface bends: the rims of openings in walls with thickness
};
/// A loop is only a candidate: it may be filled (the underside of a box on the floor, a table top); rays decide.
HoleOutlines hole_outlines(const Room& room, BorderKind kind);

/// Panes: coplanar neighbours of the same window material merged; convex parts.
struct Pane {
  Outline outline;
  std::uint32_t material = 0;
};
std::vector<Pane> window_panes(const Room& room);

/// Cuts an outline in convex parts (itself when it is convex); straight corners removed.
std::vector<Outline> convex_parts(const Outline& outline);

} // namespace daylit::detail
