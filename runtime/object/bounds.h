#pragma once

#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "runtime/base/pixel_box.h"
#include "runtime/base/render_camera.h"
#include "runtime/sky/direct_light.h"

namespace daylit {

/// A cone that holds the directions towards all lights of a group.
struct LightCone {
  glm::vec3 axis{0.0f, 0.0f, 1.0f};
  float cosine = 2.0f, sine = 0.0f; ///< of its half angle; cosine 2: no lights

  bool empty() const { return cosine > 1.0f; }
};
LightCone bounding_cone(const std::vector<DirectionalLight>& lights);

/// Points whose projections lie around those of `positions`: these themselves where they are few; else the corners of
/// boxes around runs of them, which lie close together in a mesh.
std::vector<glm::vec3> points_around(std::span<const glm::vec3> positions);

/// Drawn pixels that the points project to; the whole picture when one lies before the near plane. `positions`:
/// relative to `origin` (world metres).
PixelBox projected_box(const PinholeCamera& camera, const glm::dvec3& origin, std::span<const glm::vec3> positions);

} // namespace daylit
