#pragma once

#include <span>
#include <vector>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "runtime/light/direct_light.h"
#include "runtime/render/pixel_box.h"
#include "runtime/render/render_camera.h"

namespace daylit {

/// xyz: axis, w: half angle (radians) of a cone that holds all light directions; half angle -pi when there are none.
glm::vec4 bounding_cone(const std::vector<DirectionalLight>& lights);

/// Drawn pixels that the points project to; the whole picture when one lies before the near plane. `positions`:
/// relative to `origin` (world metres).
PixelBox projected_box(const RenderCamera& camera, const glm::dvec3& origin, std::span<const glm::vec3> positions);

} // namespace daylit
