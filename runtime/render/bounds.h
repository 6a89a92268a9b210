#pragma once

#include <vector>

#include <glm/vec4.hpp>

#include "runtime/light/direct_light.h"

namespace daylit {

/// xyz: axis, w: half angle (radians) of a cone that holds all light directions; half angle -pi when there are none.
glm::vec4 bounding_cone(const std::vector<DirectionalLight>& lights);

} // namespace daylit
