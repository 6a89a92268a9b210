#pragma once

// Planar faces of a room, merged where coplanar and of one material, re-meshed into well-shaped triangles
// (constrained Delaunay refinement, Shewchuk 2000, through CGAL). Holes stay holes; the lines where other faces touch
// or cross a plane (furniture standing on the floor) become mesh edges, so that no facet is half in the dark, but for
// single triangles under 30 cm, which curved surfaces consist of.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "radiosity/size_field.h"
#include "scene/core/result.h"
#include "scene/room/room.h"

namespace daylit::radiosity {

struct Facet {
  std::array<glm::dvec3, 3> corner; ///< metres, relative to SurfaceMesh::origin, counter-clockwise about normal
  glm::dvec3 normal{0.0};           ///< unit
  double area_m2 = 0;
  std::uint32_t plane = 0; ///< faces of one plane and material have this id
  std::uint32_t material = 0;
};

struct SurfaceMesh {
  glm::dvec3 origin{0.0}; ///< world metres of the local zero: the middle of the room
  std::vector<Facet> facets;
  std::uint32_t planes = 0;
  std::size_t fixed_facets = 0; ///< made by faces and panes whatever the edge length; 0 where that is few
  double edge_m = 0;            ///< longest facet edge that was allowed where the light is wanted
  /// Area of faces that lie on other faces and count once (of two materials that of the earlier face), m2.
  double doubled_m2 = 0;
};

struct MeshOptions {
  double edge_m = 0;        ///< longest facet edge; 0: chosen so that about target_facets result
  int target_facets = 2000; ///< used when edge_m is 0; beside SurfaceMesh::fixed_facets
  int max_facets = 60000;   ///< more is an Error limit_exceeded, not an endless run
  /// Faces that end this close to others without touching them cut those, where it matters to facets of this size
  /// (add_near_edges()). 0: only those that touch.
  double near_m = 0;
  SizeField field = {}; ///< where edges may be longer
  /// Windows: edges are short on the sills and reveals beside them.
  std::span<const Aperture> panes = {};
  /// Corners of small holes between rooms, relative to the middle of the room: edges are short in the ducts that they
  /// make of thick walls.
  std::span<const std::vector<glm::dvec3>> holes = {};
};

/// Errors: limit_exceeded (finer than max_facets), geometry_invalid (no reflecting face).
Result<SurfaceMesh> mesh_surfaces(const Room& room, const MeshOptions& options);

} // namespace daylit::radiosity
