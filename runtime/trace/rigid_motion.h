#pragma once

#include <array>
#include <span>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

namespace daylit {

/// How points have been turned since they were first given, if nothing but motion and one scale happened to them.
class RigidMotion {
public:
  RigidMotion() = default;
  explicit RigidMotion(std::vector<glm::vec3> points);
  /// The same points now. False: they have moved against each other; the rotation is then not changed.
  bool set(std::span<const glm::vec3> points);
  /// now = rotation x first, of directions.
  const glm::mat3& rotation() const { return rotation_; }

private:
  glm::mat3 axes(std::span<const glm::vec3> points) const;
  std::vector<glm::vec3> first_;
  std::array<std::size_t, 3> corner_{}; ///< a triangle as large as there is
  glm::mat3 rotation_{1.0f};
};

} // namespace daylit
