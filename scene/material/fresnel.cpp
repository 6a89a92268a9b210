#include "scene/material/fresnel.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace daylit {

// r_parallel = (n c - c_t) / (n c + c_t), r_across = (c - n c_t) / (c + n c_t), with n sin t_t = sin t.
float fresnel_dielectric(float cosine, float ior) {
  const float n = cosine < 0.0f ? 1.0f / ior : ior;
  const float c = std::min(std::abs(cosine), 1.0f);
  const float sine2 = (1.0f - c) * (1.0f + c) / (n * n);
  if (sine2 >= 1.0f)
    return 1.0f;
  const float c_t = std::sqrt(1.0f - sine2);
  const float parallel = (n * c - c_t) / (n * c + c_t), across = (c - n * c_t) / (c + n * c_t);
  return 0.5f * (parallel * parallel + across * across);
}

float ior_of(float face_on) {
  const float root = std::min(std::sqrt(face_on), 0.99f);
  return (1.0f + root) / (1.0f - root);
}

// Midpoint rule.
float mean_fresnel(float ior) {
  constexpr int kSteps = 1024;
  double sum = 0.0;
  for (int k = 0; k < kSteps; ++k) {
    const double c = (k + 0.5) / kSteps;
    sum += 2.0 * c * static_cast<double>(fresnel_dielectric(static_cast<float>(c), ior));
  }
  return static_cast<float>(sum / kSteps);
}

std::optional<glm::vec3> refracted(const glm::vec3& w, const glm::vec3& h, float ior) {
  const float c = glm::dot(w, h);
  const float sine2 = std::max(0.0f, (1.0f - c) * (1.0f + c)) / (ior * ior);
  if (sine2 >= 1.0f)
    return std::nullopt;
  return glm::normalize((c / ior - std::sqrt(1.0f - sine2)) * h - w / ior);
}

} // namespace daylit
