#include "runtime/trace/object_point.h"

#include <algorithm>

#include <glm/geometric.hpp>

namespace daylit {

namespace {
constexpr float kGrazing = 0.1f; // cosine
}

float start_offset(const TracedScene& scene) {
  return std::max(2e-5f, 3e-4f * static_cast<float>(scene.sphere.radius));
}

ObjectPoint object_point(const TracedScene& scene, const glm::vec3& eye, const ObjectHit& hit) {
  const auto& t = scene.triangles[hit.triangle];
  const float b[3] = {1.0f - hit.u - hit.v, hit.u, hit.v};
  const glm::vec3 p[3] = {scene.positions[t[0]], scene.positions[t[1]], scene.positions[t[2]]};
  ObjectPoint point;
  for (int k = 0; k < 3; ++k) {
    point.position += b[k] * p[k];
    point.normal += b[k] * scene.normals[t[k]];
  }
  const glm::vec3 facet = glm::cross(p[1] - p[0], p[2] - p[0]), to_eye = eye - point.position;
  const float length = glm::length(point.normal);
  point.normal = length > 0.0f ? point.normal / length : facet / std::max(glm::length(facet), 1e-30f);
  // The winding decides what is a back, not the normal: interpolated normals turn away at silhouettes. There a ray can
  // also slip between a facet and its neighbour that just faces away: a grazing back is the front.
  const float towards_eye = glm::dot(facet, to_eye); // times both lengths
  point.back = towards_eye < 0.0f &&
               towards_eye * towards_eye > kGrazing * kGrazing * glm::dot(facet, facet) * glm::dot(to_eye, to_eye);
  point.normal = point.back ? -point.normal : point.normal;
  return point;
}

/// A facet of a smooth surface shadows its own neighbours near the terminator. Rays start on the surface that the
/// normals describe: the mean of the point's projections onto the vertices' tangent planes, where these lie outside
/// (Hanika 2021, "Hacking the Shadow Terminator").
glm::vec3 ray_start(const TracedScene& scene, const ObjectHit& hit, const ObjectPoint& point) {
  const auto& t = scene.triangles[hit.triangle];
  const float b[3] = {1.0f - hit.u - hit.v, hit.u, hit.v}, side = point.back ? -1.0f : 1.0f;
  glm::vec3 start = point.position + start_offset(scene) * point.normal;
  for (int k = 0; k < 3; ++k) {
    const glm::vec3 n = side * scene.normals[t[k]];
    start -= b[k] * std::min(0.0f, glm::dot(point.position - scene.positions[t[k]], n)) * n;
  }
  return start;
}

} // namespace daylit
