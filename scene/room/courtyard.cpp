#include "scene/room/courtyard.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>

#include "scene/core/orthonormal.h"
#include "scene/core/r2_points.h"
#include "scene/room/polygon.h"

namespace daylit::detail {

namespace {

constexpr double kFromAbove = 0.7, kThrough = 0.01, kOpen = 0.5;
constexpr int kRays = 512, kAround = 64;
constexpr float kFar = std::numeric_limits<float>::infinity();

glm::dvec3 middle(const Aperture& a) {
  glm::dvec3 sum(0.0);
  for (const glm::dvec3& c : a.corners)
    sum += c / static_cast<double>(a.corners.size());
  return sum;
}

double horizontal_m2(const std::vector<Aperture>& hole) {
  double area = 0;
  for (const Aperture& part : hole)
    area += 0.5 * std::abs(newell_normal(part.corners).z);
  return area;
}

/// Half way down from the hole to what is below: the area seen around, at that height. 0: nothing is below.
double section_m2(const Aperture& hole, const RayScene& scene) {
  const glm::dvec3 top = middle(hole);
  RayHit hit;
  if (!scene.closest(scene.to_local(top), glm::vec3(0, 0, -1), 0.0f, kFar, hit))
    return 0.0;
  const glm::dvec3 from = top - glm::dvec3(0, 0, 0.5 * static_cast<double>(hit.distance));
  double area = 0;
  for (int k = 0; k < kAround; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / kAround;
    if (!scene.closest(scene.to_local(from), glm::vec3(std::cos(angle), std::sin(angle), 0), 0.0f, kFar, hit))
      return 0.0;
    area += std::numbers::pi / kAround * static_cast<double>(hit.distance) * static_cast<double>(hit.distance);
  }
  return area;
}

/// Part of what the outer side of a pane's middle sees that is sky through the hole.
double seen_through(const std::vector<Aperture>& hole, const Aperture& window, const RayScene& scene) {
  const glm::dvec3 from = middle(window) - 8.0 * static_cast<double>(scene.surface_offset()) * window.inward;
  int through = 0;
  for (std::uint32_t i = 0; i < kRays; ++i) {
    const glm::dvec3 d = cosine_direction(-window.inward, r2_point(i, glm::dvec2(0.5)));
    int crossed = 0;
    aperture_transmittance(hole, from, d, std::numeric_limits<double>::infinity(), &crossed);
    if (crossed > 0 && !scene.occluded(scene.to_local(from), glm::vec3(d), 0.0f, kFar))
      ++through;
  }
  return static_cast<double>(through) / kRays;
}

} // namespace

bool is_over_courtyard(const std::vector<Aperture>& hole, const std::vector<Aperture>& windows, const RayScene& scene) {
  const double below_m2 = section_m2(hole[0], scene);
  return below_m2 > 0.0 && horizontal_m2(hole) >= kOpen * below_m2 &&
         std::ranges::all_of(hole, [](const Aperture& part) { return part.inward.z < -kFromAbove; }) &&
         std::ranges::any_of(windows, [&](const Aperture& w) { return seen_through(hole, w, scene) >= kThrough; });
}

} // namespace daylit::detail
