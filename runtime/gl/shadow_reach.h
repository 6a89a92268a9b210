#pragma once

// Which points of the room the objects can shadow at all.

#include <array>
#include <span>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "runtime/object/bounds.h"

namespace daylit {

/// Up to four edges of a window, relative to the renderer's origin; dot(edge.xyz, x) + edge.w is positive inside, the
/// same of the plane in front of the window.
struct WindowEdges {
  glm::vec4 plane{0.0f};
  std::array<glm::vec4, 4> edges{};
};

struct ShadowReach {
  glm::vec3 centre{0.0f}; ///< of a sphere around the objects
  float radius = 0.0f;
  LightCone sky, sun;
  std::span<const WindowEdges> windows;

  /// False when no light that comes through a window meets the sphere on its way to x. Conservative.
  bool meets(const glm::vec3& x) const;

private:
  bool from_cone(const LightCone& cone, const glm::vec3& offset) const;
  bool stands_before_window(const glm::vec3& x, const glm::vec3& offset) const;
};

} // namespace daylit
