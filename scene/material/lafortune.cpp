#include "scene/material/lafortune.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace daylit {

namespace {

constexpr float kPi = std::numbers::pi_v<float>;

} // namespace

Rgb LafortunePeak::sent(const glm::vec3& in) const {
  const float along = glm::dot(direction, in);
  if (along <= 0.0f || in.z <= 0.0f)
    return Rgb(0.0f);
  const float cosine = (1.0f - grazing) * (exponent + 2.0f) * in.z + grazing * (exponent + 1.0f);
  return strength * (std::pow(std::min(along, 1.0f), exponent) * cosine / (2.0f * kPi));
}

glm::vec3 LafortunePeak::sample(const glm::vec2& u) const {
  const float cosine = std::pow(1.0f - u.x, 1.0f / (exponent + 1.0f)), angle = 2.0f * kPi * u.y;
  const float sine = std::sqrt((1.0f - cosine) * (1.0f + cosine));
  const glm::vec3 across = std::abs(direction.z) < 0.9f ? glm::vec3(0.0f, 0.0f, 1.0f) : glm::vec3(1.0f, 0.0f, 0.0f);
  const glm::vec3 x = glm::normalize(glm::cross(across, direction)), y = glm::cross(direction, x);
  return glm::normalize(sine * (std::cos(angle) * x + std::sin(angle) * y) + cosine * direction);
}

float LafortunePeak::density(const glm::vec3& in) const {
  const float along = glm::dot(direction, in);
  return along <= 0.0f ? 0.0f : (exponent + 1.0f) * std::pow(std::min(along, 1.0f), exponent) / (2.0f * kPi);
}

Rgb LafortunePeak::albedo() const {
  const float above = std::clamp(direction.z, 0.0f, 1.0f), spread = 0.5f * (1.0f - above) / (exponent + 1.0f);
  return strength * ((1.0f - grazing) * (above + spread) + grazing * (1.0f - spread));
}

LafortunePeak LafortuneLobe::peak(const glm::vec3& out) const {
  const glm::vec3 size = glm::abs(c), p = c * out / std::max({size.x, size.y, size.z});
  const float length = glm::length(p);
  LafortunePeak at;
  at.direction = length > 0.0f ? p / length : glm::vec3(0.0f, 0.0f, 1.0f);
  at.grazing = grazing * std::pow(std::clamp(1.0f - out.z, 0.0f, 1.0f), falloff);
  at.exponent = std::pow(exponent, 1.0f - at.grazing) * std::pow(kMostExponent, at.grazing);
  at.strength = (weight + (1.0f - weight) * at.grazing) * std::pow(std::min(length, 1.0f), at.exponent);
  return at;
}

Rgb LafortuneLobe::base(const Rgb& colour, const LafortunePeak& seen) const {
  return (1.0f - seen.grazing) * glm::min(colour, 1.0f - weight);
}

float LafortuneLobe::alpha() const { return std::sqrt(2.0f / (4.0f * exponent + 2.0f)); }

} // namespace daylit
