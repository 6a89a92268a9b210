#include "runtime/render/bounds.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "runtime/render/picture_renderer.h"

namespace daylit {

BoundingSphere ObjectSurface::bounds() const {
  Bounds box;
  for (const auto& t : triangles)
    for (const std::uint32_t v : t)
      box.include(positions[v]);
  if (box.empty())
    return {};
  BoundingSphere sphere{box.centre(), 0.0};
  for (const auto& t : triangles)
    for (const std::uint32_t v : t)
      sphere.radius = std::max(sphere.radius, glm::length(positions[v] - sphere.centre));
  sphere.radius *= 1.0 + 1e-5; // the float shadow map coordinates of the farthest vertex stay inside
  return sphere;
}

glm::vec4 bounding_cone(const std::vector<DirectionalLight>& lights) {
  glm::dvec3 sum(0.0);
  for (const DirectionalLight& l : lights)
    sum += l.direction;
  if (lights.empty())
    return {0.0f, 0.0f, 1.0f, -std::numbers::pi_v<float>};
  const double length = glm::length(sum);
  const glm::dvec3 axis = length > 1e-6 ? sum / length : glm::dvec3(0.0, 0.0, 1.0);
  double cosine = 1.0;
  for (const DirectionalLight& l : lights)
    cosine = std::min(cosine, glm::dot(axis, l.direction));
  return {glm::vec3(axis), static_cast<float>(std::acos(std::clamp(cosine, -1.0, 1.0)) + 1e-3)};
}

} // namespace daylit
