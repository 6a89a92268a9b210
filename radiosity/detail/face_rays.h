#pragma once

// Many rays from one point against the faces of a room, sixteen at a time.

#include <array>
#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

namespace daylit::radiosity {

/// One face seen from a point: a ray d passes inside where all of edge * d are >= 0, at distance 1 / (nearness * d).
struct SeenFace {
  std::array<glm::vec3, 3> edge; ///< unit, of the planes through the point and an edge
  glm::vec3 nearness;            ///< 1 / metres
};

/// Rays of the same index in x, y and z, unit directions.
struct RayComponents {
  const float *x, *y, *z;
  std::size_t count;
};

/// Where the face is nearer than what a ray has met: nearest[ray] = 1 / distance, plane[ray] = `plane_of_face`.
void meet_face(const SeenFace& face, const RayComponents& rays, std::int32_t plane_of_face, float* nearest,
               std::int32_t* plane);

/// The planes of the faces as rays from one point meet them, in cells of their tables: a ray d meets its plane at
/// (u, v) = start + (along . d) / nearness.
struct PlaneViews {
  std::array<std::vector<float>, 3> along_u, along_v;
  std::vector<float> start_u, start_v;
  std::vector<std::int32_t> width, height, first_cell; ///< of the tables
};

/// Where each ray meets its plane (-1: none) and in which cell that is; cell 0 where no table is met.
void find_cells(const PlaneViews& planes, const RayComponents& rays, const float* nearness, const std::int32_t* plane,
                float* u, float* v, std::int32_t* cell);

} // namespace daylit::radiosity
