#pragma once

#include <vector>

#include <glm/vec3.hpp>

#include "scene/room/room.h"

namespace daylit {

/// An aperture as what lies beside it sees it: the light changes there within a part of its width.
struct PaneOutline {
  std::vector<glm::dvec3> corners; ///< metres, relative to `origin`
  glm::dvec3 inward;
  double width_m; ///< the shorter side: the least extent across one of its sides

  PaneOutline(const Aperture& aperture, const glm::dvec3& origin);
  /// To the nearest of its sides.
  double distance(const glm::dvec3& p) const;
};

} // namespace daylit
