#include "simulate/aperture_sampler.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace daylit {

namespace {

constexpr double kSmallestSolidAngle = 1e-12; // sr; a window this edge on gives no light that matters

/// Splits u over entries of given weights; returns the index and stretches u back to [0, 1).
template <class Weight>
std::size_t choose(std::size_t count, double total, float& u, Weight weight) {
  double target = static_cast<double>(u) * total;
  for (std::size_t i = 0; i < count; ++i) {
    const double w = weight(i);
    if (target < w || i + 1 == count) {
      u = w > 0.0 ? static_cast<float>(std::clamp(target / w, 0.0, 1.0 - 0x1p-24)) : 0.0f;
      return i;
    }
    target -= w;
  }
  return 0;
}

double triangle_area(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  return 0.5 * glm::length(glm::cross(b - a, c - a));
}

/// Angle at corner a of the spherical triangle of unit vectors a, b, c.
double spherical_angle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const glm::dvec3 ab = glm::cross(a, b), ac = glm::cross(a, c);
  return std::atan2(std::abs(glm::dot(a, glm::cross(b, c))), glm::dot(ab, ac));
}

} // namespace

double triangle_solid_angle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
  const double volume = std::abs(glm::dot(a, glm::cross(b, c)));
  const double denominator = la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb;
  return 2.0 * std::atan2(volume, denominator);
}

glm::dvec3 sample_triangle_direction(const glm::dvec3& corner_a, const glm::dvec3& corner_b, const glm::dvec3& corner_c,
                                     const glm::vec2& u) {
  const glm::dvec3 a = glm::normalize(corner_a), b = glm::normalize(corner_b), c = glm::normalize(corner_c);
  const double area = static_cast<double>(u.x) * triangle_solid_angle(a, b, c);
  const double alpha = spherical_angle(a, b, c);
  // Arvo 1995: the sub-triangle a, b, c' of the sampled area ends at c' on the arc a-c.
  const double sin_t = std::sin(area - alpha), cos_t = std::cos(area - alpha);
  const double sin_alpha = std::sin(alpha), cos_alpha = std::cos(alpha), cos_c = glm::dot(a, b);
  const double p = cos_t - cos_alpha, q = sin_t + sin_alpha * cos_c;
  const double numerator = (q * cos_t - p * sin_t) * cos_alpha - q, denominator = (q * sin_t + p * cos_t) * sin_alpha;
  const double cos_b = denominator == 0.0 ? 1.0 : std::clamp(numerator / denominator, -1.0, 1.0);
  const auto perpendicular = [](const glm::dvec3& v, const glm::dvec3& axis) {
    const glm::dvec3 d = v - glm::dot(v, axis) * axis;
    const double length = glm::length(d);
    return length > 0.0 ? d / length : d;
  };
  const glm::dvec3 c_hat = cos_b * a + std::sqrt(std::max(0.0, 1.0 - cos_b * cos_b)) * perpendicular(c, a);
  const double z = 1.0 - static_cast<double>(u.y) * (1.0 - glm::dot(c_hat, b));
  return glm::normalize(z * b + std::sqrt(std::max(0.0, 1.0 - z * z)) * perpendicular(c_hat, b));
}

ApertureSampler::ApertureSampler(std::span<const Aperture> apertures, const glm::dvec3& origin) {
  for (const Aperture& a : apertures) {
    Pane pane{{}, a.inward, 0.0, a.transmittance};
    for (const glm::dvec3& corner : a.corners)
      pane.corners.push_back(corner - origin);
    for (std::size_t i = 2; i < pane.corners.size(); ++i)
      pane.area_m2 += triangle_area(pane.corners[0], pane.corners[i - 1], pane.corners[i]);
    if (pane.area_m2 > 0.0)
      panes_.push_back(std::move(pane));
  }
}

bool ApertureSampler::crosses(const Pane& pane, const glm::dvec3& point, const glm::dvec3& direction,
                              double& distance) {
  const double speed = glm::dot(direction, pane.inward);
  if (speed == 0.0)
    return false;
  distance = glm::dot(pane.corners[0] - point, pane.inward) / speed;
  if (!(distance > 0.0))
    return false;
  // Convex outline: the crossing lies on the same side of every edge.
  const glm::dvec3 x = point + distance * direction;
  bool left = false, right = false;
  for (std::size_t i = 0; i < pane.corners.size(); ++i) {
    const glm::dvec3& from = pane.corners[i];
    const glm::dvec3& to = pane.corners[(i + 1) % pane.corners.size()];
    const double side = glm::dot(glm::cross(to - from, x - from), pane.inward);
    left = left || side > 0.0;
    right = right || side < 0.0;
  }
  return !(left && right);
}

double ApertureSampler::seen_solid_angle(const Pane& pane, const glm::dvec3& point) const {
  if (glm::dot(point - pane.corners[0], pane.inward) <= 0.0)
    return 0.0;
  double sum = 0.0;
  for (std::size_t i = 2; i < pane.corners.size(); ++i)
    sum += triangle_solid_angle(pane.corners[0] - point, pane.corners[i - 1] - point, pane.corners[i] - point);
  return sum;
}

std::optional<ApertureSample> ApertureSampler::sample(const glm::vec3& local_point, const glm::vec2& u_in) const {
  const glm::dvec3 p(local_point);
  double total = 0.0;
  for (const Pane& pane : panes_)
    total += seen_solid_angle(pane, p);
  if (total < kSmallestSolidAngle)
    return std::nullopt;
  glm::vec2 u = u_in;
  const Pane& pane =
      panes_[choose(panes_.size(), total, u.x, [&](std::size_t i) { return seen_solid_angle(panes_[i], p); })];
  const auto part = [&](std::size_t i) {
    return triangle_solid_angle(pane.corners[0] - p, pane.corners[i + 1] - p, pane.corners[i + 2] - p);
  };
  const std::size_t k = choose(pane.corners.size() - 2, seen_solid_angle(pane, p), u.x, part);
  const glm::dvec3 d =
      sample_triangle_direction(pane.corners[0] - p, pane.corners[k + 1] - p, pane.corners[k + 2] - p, u);
  // Openings are chosen by solid angle: the mixture is 1 / total, once per opening that the direction crosses.
  int crossed = 0;
  Rgb transmittance(1.0f);
  for (const Pane& other : panes_) {
    double distance = 0.0;
    const bool chosen = &other == &pane;
    if (!chosen && !crosses(other, p, d, distance))
      continue;
    transmittance *= other.transmittance;
    crossed += chosen || glm::dot(p - other.corners[0], other.inward) > 0.0 ? 1 : 0;
  }
  return ApertureSample{glm::vec3(d), static_cast<float>(crossed / total), transmittance};
}

float ApertureSampler::density(const glm::vec3& local_point, const glm::vec3& direction) const {
  const glm::dvec3 p(local_point), d(direction);
  int crossed = 0;
  for (const Pane& pane : panes_) {
    double distance = 0.0;
    crossed += glm::dot(p - pane.corners[0], pane.inward) > 0.0 && crosses(pane, p, d, distance) ? 1 : 0;
  }
  if (crossed == 0)
    return 0.0f;
  double total = 0.0;
  for (const Pane& pane : panes_)
    total += seen_solid_angle(pane, p);
  return total < kSmallestSolidAngle ? 0.0f : static_cast<float>(crossed / total);
}

Rgb ApertureSampler::transmittance(const glm::vec3& local_point, const glm::vec3& direction) const {
  Rgb product(1.0f);
  for (const Pane& pane : panes_) {
    double distance = 0.0;
    if (pane.transmittance != Rgb(1.0f) && crosses(pane, glm::dvec3(local_point), glm::dvec3(direction), distance))
      product *= pane.transmittance;
  }
  return product;
}

double ApertureSampler::total_cross_section(const glm::dvec3& to_sun) const {
  double total = 0.0;
  for (const Pane& pane : panes_)
    total += pane.area_m2 * std::max(0.0, -glm::dot(pane.inward, to_sun));
  return total;
}

std::optional<glm::vec3> ApertureSampler::sample_beam(const glm::vec3& to_sun, const glm::vec2& u_in) const {
  const glm::dvec3 s(to_sun);
  const double total = total_cross_section(s);
  if (!(total > 0.0))
    return std::nullopt;
  glm::vec2 u = u_in;
  const auto cross_section = [&](std::size_t i) {
    return panes_[i].area_m2 * std::max(0.0, -glm::dot(panes_[i].inward, s));
  };
  const Pane& pane = panes_[choose(panes_.size(), total, u.x, cross_section)];
  const auto part = [&](std::size_t i) {
    return triangle_area(pane.corners[0], pane.corners[i + 1], pane.corners[i + 2]);
  };
  const std::size_t k = choose(pane.corners.size() - 2, pane.area_m2, u.x, part);
  const double root = std::sqrt(static_cast<double>(u.x)), v = static_cast<double>(u.y);
  return glm::vec3((1.0 - root) * pane.corners[0] + root * ((1.0 - v) * pane.corners[k + 1] + v * pane.corners[k + 2]));
}

float ApertureSampler::beam_density(const glm::vec3& local_point, const glm::vec3& to_sun) const {
  const glm::dvec3 p(local_point), s(to_sun);
  int crossed = 0;
  for (const Pane& pane : panes_) {
    double distance = 0.0;
    crossed += glm::dot(pane.inward, s) < 0.0 && crosses(pane, p, s, distance) ? 1 : 0;
  }
  return crossed == 0 ? 0.0f : static_cast<float>(crossed / total_cross_section(s));
}

} // namespace daylit
