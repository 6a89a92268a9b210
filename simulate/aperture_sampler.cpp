#include "simulate/aperture_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <glm/geometric.hpp>

#include "scene/room/glass.h"

namespace daylit {

namespace {

constexpr double kSmallestSolidAngle = 1e-12; // sr; a window this edge on gives no light that matters

/// Weights of the parts of all openings; on the stack in any ordinary room.
class PartWeights {
public:
  explicit PartWeights(std::size_t count) : count_(count) {
    if (count > fixed_.size())
      large_.resize(count);
  }
  double& operator[](std::size_t i) { return large_.empty() ? fixed_[i] : large_[i]; }
  /// Picks an entry with u, stretches u back to [0, 1).
  std::size_t choose(double total, float& u) {
    double target = static_cast<double>(u) * total;
    std::size_t last = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const double w = (*this)[i];
      if (w <= 0.0)
        continue;
      last = i;
      if (target < w)
        break;
      target -= w;
    }
    u = static_cast<float>(std::clamp(target / (*this)[last], 0.0, 1.0 - 0x1p-24));
    return last;
  }

private:
  std::size_t count_;
  std::array<double, 32> fixed_{};
  std::vector<double> large_;
};

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

Rgb ApertureSampler::Pane::at(const glm::dvec3& d) const {
  return pane_transmittance(transmittance, refractive_index, glm::dot(d, inward));
}

ApertureSampler::ApertureSampler(std::span<const Aperture> apertures, const glm::dvec3& origin) {
  for (const Aperture& a : apertures) {
    Pane pane{{}, a.inward, a.transmittance, a.refractive_index};
    for (const glm::dvec3& corner : a.corners)
      pane.corners.push_back(corner - origin);
    const auto index = static_cast<std::uint32_t>(panes_.size());
    for (std::size_t i = 2; i < pane.corners.size(); ++i) {
      const Part part{index, pane.corners[0], pane.corners[i - 1], pane.corners[i],
                      triangle_area(pane.corners[0], pane.corners[i - 1], pane.corners[i])};
      if (part.area_m2 > 0.0)
        parts_.push_back(part);
    }
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

bool ApertureSampler::faces(const Pane& pane, const glm::dvec3& point) const {
  return glm::dot(point - pane.corners[0], pane.inward) > 0.0;
}

double ApertureSampler::seen_solid_angle(const Part& part, const glm::dvec3& point) const {
  return faces(panes_[part.pane], point) ? triangle_solid_angle(part.a - point, part.b - point, part.c - point) : 0.0;
}

std::optional<ApertureSample> ApertureSampler::sample(const glm::vec3& local_point, const glm::vec2& u_in) const {
  const glm::dvec3 p(local_point);
  PartWeights weight(parts_.size());
  double total = 0.0;
  for (std::size_t i = 0; i < parts_.size(); ++i)
    total += weight[i] = seen_solid_angle(parts_[i], p);
  if (total < kSmallestSolidAngle)
    return std::nullopt;
  glm::vec2 u = u_in;
  const Part& part = parts_[weight.choose(total, u.x)];
  const glm::dvec3 d = sample_triangle_direction(part.a - p, part.b - p, part.c - p, u);
  // Parts are chosen by solid angle: the density is 1 / total, once per opening that the direction crosses.
  int crossed = 1;
  Rgb transmittance = panes_[part.pane].at(d);
  for (std::size_t i = 0; i < panes_.size(); ++i) {
    double distance = 0.0;
    if (i == part.pane || !crosses(panes_[i], p, d, distance))
      continue;
    transmittance *= panes_[i].at(d);
    crossed += faces(panes_[i], p) ? 1 : 0;
  }
  return ApertureSample{glm::vec3(d), static_cast<float>(crossed / total), transmittance};
}

float ApertureSampler::density(const glm::vec3& local_point, const glm::vec3& direction) const {
  const glm::dvec3 p(local_point), d(direction);
  int crossed = 0;
  for (const Pane& pane : panes_) {
    double distance = 0.0;
    crossed += faces(pane, p) && crosses(pane, p, d, distance) ? 1 : 0;
  }
  if (crossed == 0)
    return 0.0f;
  double total = 0.0;
  for (const Part& part : parts_)
    total += seen_solid_angle(part, p);
  return total < kSmallestSolidAngle ? 0.0f : static_cast<float>(crossed / total);
}

Rgb ApertureSampler::transmittance(const glm::vec3& local_point, const glm::vec3& direction) const {
  Rgb product(1.0f);
  for (const Pane& pane : panes_) {
    double distance = 0.0;
    if (pane.is_open() || !crosses(pane, glm::dvec3(local_point), glm::dvec3(direction), distance))
      continue;
    product *= pane.at(glm::dvec3(direction));
  }
  return product;
}

double ApertureSampler::cross_section(const Part& part, const glm::dvec3& to_sun) const {
  return part.area_m2 * std::max(0.0, -glm::dot(panes_[part.pane].inward, to_sun));
}

std::optional<glm::vec3> ApertureSampler::sample_beam(const glm::vec3& to_sun, const glm::vec2& u_in) const {
  const glm::dvec3 s(to_sun);
  PartWeights weight(parts_.size());
  double total = 0.0;
  for (std::size_t i = 0; i < parts_.size(); ++i)
    total += weight[i] = cross_section(parts_[i], s);
  if (!(total > 0.0))
    return std::nullopt;
  glm::vec2 u = u_in;
  const Part& part = parts_[weight.choose(total, u.x)];
  const double root = std::sqrt(static_cast<double>(u.x)), v = static_cast<double>(u.y);
  return glm::vec3((1.0 - root) * part.a + root * ((1.0 - v) * part.b + v * part.c));
}

float ApertureSampler::beam_density(const glm::vec3& local_point, const glm::vec3& to_sun) const {
  const glm::dvec3 p(local_point), s(to_sun);
  int crossed = 0;
  for (const Pane& pane : panes_) {
    double distance = 0.0;
    crossed += glm::dot(pane.inward, s) < 0.0 && crosses(pane, p, s, distance) ? 1 : 0;
  }
  if (crossed == 0)
    return 0.0f;
  double total = 0.0;
  for (const Part& part : parts_)
    total += cross_section(part, s);
  return static_cast<float>(crossed / total);
}

} // namespace daylit
