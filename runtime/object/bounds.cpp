#include "runtime/object/bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/object/object_surface.h"

namespace daylit {

/// Around the middle of the bounding box; at most sqrt 3 times as wide as the smallest sphere.
BoundingSphere ObjectSurface::bounds() const {
  Bounds box;
  for (const auto& t : triangles)
    for (const std::uint32_t v : t)
      box.include(positions[v]);
  if (box.empty())
    return {};
  BoundingSphere sphere{box.centre(), 0.0};
  double farthest2 = 0.0;
  for (const auto& t : triangles)
    for (const std::uint32_t v : t) {
      const glm::dvec3 d = positions[v] - sphere.centre;
      farthest2 = std::max(farthest2, glm::dot(d, d));
    }
  sphere.radius =
      std::sqrt(farthest2) * (1.0 + 1e-5); // the float shadow map coordinates of the farthest vertex stay inside
  return sphere;
}

/// Axis: the mean direction; half angle: to the farthest light, widened by 1e-3 radians for single precision.
LightCone bounding_cone(const std::vector<DirectionalLight>& lights) {
  glm::dvec3 sum(0.0);
  for (const DirectionalLight& l : lights)
    sum += l.direction;
  if (lights.empty())
    return {};
  const double length = glm::length(sum);
  const glm::dvec3 axis = length > 1e-6 ? sum / length : glm::dvec3(0.0, 0.0, 1.0);
  double cosine = 1.0;
  for (const DirectionalLight& l : lights)
    cosine = std::min(cosine, glm::dot(axis, l.direction));
  const double half_angle = std::acos(std::clamp(cosine, -1.0, 1.0)) + 1e-3;
  return {glm::vec3(axis), static_cast<float>(std::cos(half_angle)), static_cast<float>(std::sin(half_angle))};
}

std::vector<glm::vec3> points_around(std::span<const glm::vec3> positions) {
  constexpr std::size_t kFew = 16384, kRun = 32; // eight corners each
  if (positions.size() <= kFew)
    return {positions.begin(), positions.end()};
  std::vector<glm::vec3> corners;
  for (std::size_t first = 0; first < positions.size(); first += kRun) {
    glm::vec3 low = positions[first], high = low;
    for (const glm::vec3& p : positions.subspan(first, std::min(kRun, positions.size() - first))) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
    for (int k = 0; k < 8; ++k)
      corners.emplace_back(k & 1 ? high.x : low.x, k & 2 ? high.y : low.y, k & 4 ? high.z : low.z);
  }
  return corners;
}

/// Pinhole: x = fx X / Z + cx, y = fy Y / Z + cy, with (X, Y, Z) = R^T (p - eye).
PixelBox projected_box(const PinholeCamera& camera, const glm::dvec3& origin, std::span<const glm::vec3> positions) {
  const PixelBox whole{0, 0, camera.width_px, camera.height_px};
  if (positions.empty())
    return {};
  const glm::dmat3 axes(camera.world_from_camera);
  const glm::dvec3 eye = camera.eye() - origin;
  glm::dvec2 lo(std::numeric_limits<double>::infinity()), hi = -lo;
  for (const glm::vec3& p : positions) {
    const glm::dvec3 c = (glm::dvec3(p) - eye) * axes; // transpose of a rotation
    if (c.z < kNearPlane_m)
      return whole;
    const glm::dvec2 pixel(camera.fx * c.x / c.z + camera.cx, camera.fy * c.y / c.z + camera.cy);
    lo = glm::min(lo, pixel);
    hi = glm::max(hi, pixel);
  }
  lo = glm::clamp(lo, -2.0, 1e6);
  hi = glm::clamp(hi, -2.0, 1e6);
  return PixelBox{static_cast<int>(std::floor(lo.x)), static_cast<int>(std::floor(lo.y)),
                  static_cast<int>(std::ceil(hi.x)) + 1, static_cast<int>(std::ceil(hi.y)) + 1}
      .clipped(camera.width_px, camera.height_px);
}

} // namespace daylit
