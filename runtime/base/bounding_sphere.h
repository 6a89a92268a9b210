#pragma once

#include <glm/vec3.hpp>

namespace daylit {

struct BoundingSphere {
  glm::dvec3 centre{0.0}; ///< world metres
  double radius = 0.0;    ///< metres
};

} // namespace daylit
