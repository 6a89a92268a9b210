#pragma once

// Which parts of the room can stand before the objects at all: most lights need no rays to find that none does.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

namespace daylit {

class ShadowBounds {
public:
  ShadowBounds() = default;
  ShadowBounds(std::span<const glm::vec3> vertices, std::span<const std::array<std::uint32_t, 3>> triangles);

  /// False when no ray that starts in the sphere and runs along the unit direction w meets a triangle. Conservative.
  bool may_block(const glm::vec3& w, const glm::vec3& centre, float radius) const;

private:
  struct Triangle {
    std::array<glm::vec3, 3> corners;
    glm::vec3 centre{0.0f}; ///< of a sphere around it
    float radius = 0.0f;
  };
  std::vector<Triangle> triangles_;
};

} // namespace daylit
