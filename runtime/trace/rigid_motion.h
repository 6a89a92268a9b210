#pragma once

#include <array>
#include <span>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

namespace daylit {

/// x -> origin + axes x, where the axes are orthogonal and of one length.
struct Similarity {
  glm::mat3 axes{1.0f};
  glm::vec3 origin{0.0f};
};

/// How points have moved since they were first given, if nothing but motion and one scale happened to them.
class RigidMotion {
public:
  RigidMotion() = default;
  explicit RigidMotion(std::vector<glm::vec3> points);
  /// The same points now. False: they have moved against each other; nothing is then changed.
  bool set(std::span<const glm::vec3> points);
  /// From where a point moving with them is now to where it was first.
  const Similarity& to_first() const { return to_first_; }

private:
  glm::mat3 axes(std::span<const glm::vec3> points) const;
  std::vector<glm::vec3> first_;
  std::array<std::size_t, 3> corner_{}; ///< a triangle as large as there is
  Similarity to_first_;
};

} // namespace daylit
