#include "scene/material/ggx.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace daylit {

namespace {
constexpr float kPi = std::numbers::pi_v<float>;
} // namespace

// D = 1 / (pi a b ((x / a)^2 + (y / b)^2 + z^2)^2).
float Ggx::distribution(const glm::vec3& h) const {
  const float x = h.x / alpha_u, y = h.y / alpha_v;
  const float s = x * x + y * y + h.z * h.z;
  return 1.0f / (kPi * alpha_u * alpha_v * s * s);
}

// (sqrt(1 + ((a x)^2 + (b y)^2) / z^2) - 1) / 2; written so that small slopes do not cancel.
float Ggx::lambda(const glm::vec3& w) const {
  const float x = alpha_u * w.x, y = alpha_v * w.y;
  const float t = (x * x + y * y) / (w.z * w.z);
  return 0.5f * t / (1.0f + std::sqrt(1.0f + t));
}

// The normals of a stretched half ball as seen from w: a reflected direction uniform on the cap around z, halved with
// w.
glm::vec3 Ggx::sample_visible(const glm::vec3& w, const glm::vec2& u) const {
  const glm::vec3 ball = glm::normalize(glm::vec3(alpha_u * w.x, alpha_v * w.y, w.z));
  const float phi = 2.0f * kPi * u.x;
  const float z = (1.0f - u.y) * (1.0f + ball.z) - ball.z;
  const float r = std::sqrt(std::clamp(1.0f - z * z, 0.0f, 1.0f));
  const glm::vec3 h = glm::vec3(r * std::cos(phi), r * std::sin(phi), z) + ball;
  return glm::normalize(glm::vec3(alpha_u * h.x, alpha_v * h.y, std::max(h.z, 1e-12f)));
}

// The normal of the half ball, and the direction that it reflects the stretched w to.
glm::vec2 Ggx::invert_visible(const glm::vec3& w, const glm::vec3& h) const {
  const glm::vec3 ball = glm::normalize(glm::vec3(alpha_u * w.x, alpha_v * w.y, w.z));
  const glm::vec3 normal = glm::normalize(glm::vec3(h.x / alpha_u, h.y / alpha_v, h.z));
  const glm::vec3 reflected = 2.0f * glm::dot(ball, normal) * normal - ball;
  const float turn = std::atan2(reflected.y, reflected.x) / (2.0f * kPi);
  return {turn < 0.0f ? turn + 1.0f : turn, 1.0f - (reflected.z + ball.z) / (1.0f + ball.z)};
}

// G1 max(0, w.h) D / w.z.
float Ggx::visible_density(const glm::vec3& w, const glm::vec3& h) const {
  return masking(w) * std::max(0.0f, glm::dot(w, h)) * distribution(h) / std::abs(w.z);
}

} // namespace daylit
