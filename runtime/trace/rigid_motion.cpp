#include "runtime/trace/rigid_motion.h"

#include <utility>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace daylit {

namespace {
constexpr float kTolerance = 1e-4f; // of the distance between the corners

template <class Measure>
std::size_t largest(std::size_t count, const Measure& measure) {
  std::size_t best = 0;
  float most = -1.0f;
  for (std::size_t i = 0; i < count; ++i)
    if (const float m = measure(i); m > most) {
      most = m;
      best = i;
    }
  return best;
}
} // namespace

RigidMotion::RigidMotion(std::vector<glm::vec3> points) : first_(std::move(points)) {
  const auto& p = first_;
  if (p.empty())
    return;
  const std::size_t b = largest(p.size(), [&](std::size_t i) { return glm::length(p[i] - p[0]); });
  const std::size_t c =
      largest(p.size(), [&](std::size_t i) { return glm::length(glm::cross(p[i] - p[0], p[b] - p[0])); });
  corner_ = {0, b, c};
}

/// Orthonormal while the corners form a triangle.
glm::mat3 RigidMotion::axes(std::span<const glm::vec3> p) const {
  const glm::vec3 x = glm::normalize(p[corner_[1]] - p[corner_[0]]);
  const glm::vec3 z = glm::normalize(glm::cross(x, p[corner_[2]] - p[corner_[0]]));
  return {x, glm::cross(z, x), z};
}

bool RigidMotion::set(std::span<const glm::vec3> points) {
  if (points.size() != first_.size() || points.empty())
    return false;
  const glm::vec3 from = first_[corner_[0]], to = points[corner_[0]];
  const float extent = glm::length(points[corner_[1]] - to), scale = extent / glm::length(first_[corner_[1]] - from);
  const glm::mat3 rotation = axes(points) * glm::transpose(axes(first_));
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!(glm::length(to + scale * (rotation * (first_[i] - from)) - points[i]) <= kTolerance * extent))
      return false;
  to_first_.axes = glm::transpose(rotation) / scale;
  to_first_.origin = from - to_first_.axes * to;
  return true;
}

} // namespace daylit
