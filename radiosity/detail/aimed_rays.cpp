#include "radiosity/detail/aimed_rays.h"

#include <algorithm>
#include <numbers>

#include <glm/geometric.hpp>

#include "radiosity/detail/sampling.h"
#include "sh/band4.h"
#include "sh/sh9.h"

namespace daylit::radiosity {

namespace {

glm::dvec3 middle_of(const HoleOutline& outline) {
  glm::dvec3 sum(0.0);
  for (const glm::dvec3& c : outline)
    sum += c;
  return sum / static_cast<double>(outline.size());
}

} // namespace

HoleView HoleView::of(const HoleOutline& outline, const glm::dvec3& point) {
  HoleView view;
  glm::dvec3 middle(0.0);
  for (const glm::dvec3& c : outline) {
    const double distance = glm::distance(c, point);
    if (!(distance > 0.0))
      return {};
    middle += view.corner.emplace_back((c - point) / distance);
  }
  for (std::size_t k = 0; k < view.corner.size(); ++k) {
    const glm::dvec3 across = glm::cross(view.corner[k], view.corner[(k + 1) % view.corner.size()]);
    view.inward.push_back(glm::dot(across, middle) < 0.0 ? -across : across);
  }
  for (std::size_t k = 1; k + 1 < view.corner.size(); ++k)
    view.solid_angle_sr += spherical_triangle_sr(view.corner[0], view.corner[k], view.corner[k + 1]);
  return view;
}

bool HoleView::holds(const glm::dvec3& d) const {
  return std::ranges::all_of(inward, [&](const glm::dvec3& n) { return glm::dot(n, d) > 0.0; });
}

/// One of the triangles by its solid angle, then uniform in it (Arvo 1995).
glm::dvec3 HoleView::direction(const glm::dvec2& u) const {
  double pick = u.x * solid_angle_sr, part = 0.0;
  std::size_t k = 1;
  for (;; ++k) {
    part = spherical_triangle_sr(corner[0], corner[k], corner[k + 1]);
    if (pick <= part || k + 2 >= corner.size())
      break;
    pick -= part;
  }
  return on_spherical_triangle(corner[0], corner[k], corner[k + 1],
                               {part > 0.0 ? std::min(pick / part, 1.0) : 0.0, u.y});
}

AimedRays AimedRays::of(const glm::dvec3& point, std::span<const HoleOutline> holes, int rays_of_fan,
                        const std::function<bool(const glm::vec3& way)>& sees) {
  constexpr double kLeast_sr = 1e-7;
  const double most_sr = 4.0 * std::numbers::pi * kRaysOfHole / rays_of_fan;
  std::vector<std::pair<double, std::size_t>> by_size;
  for (std::size_t h = 0; h < holes.size(); ++h)
    if (const double sr = HoleView::of(holes[h], point).solid_angle_sr; sr > kLeast_sr && sr < most_sr)
      by_size.emplace_back(-sr, h);
  std::ranges::sort(by_size);
  AimedRays aimed;
  for (const auto& [less_sr, h] : by_size) {
    const glm::dvec3 way = middle_of(holes[h]) - point;
    if (aimed.hole.size() == kMostHoles)
      break;
    if (!aimed.covers(way) && sees(glm::vec3(way)))
      aimed.add(HoleView::of(holes[h], point));
  }
  return aimed;
}

void AimedRays::add(HoleView view) {
  for (std::uint32_t k = 0; k < kRaysOfHole; ++k)
    if (const glm::dvec3 d = view.direction(r2_point(k, random_shift(hole.size()))); !covers(d))
      ray.push_back({glm::vec3(d), static_cast<float>(view.solid_angle_sr / kRaysOfHole), -1});
  hole.push_back(std::move(view));
}

bool AimedRays::covers(const glm::dvec3& d) const {
  return std::ranges::any_of(hole, [&](const HoleView& view) { return view.holds(d); });
}

double AimedRays::light(std::span<const float> radiosity) const {
  double sum = 0.0;
  for (const AimedRay& r : ray)
    if (r.patch >= 0)
      sum += static_cast<double>(r.solid_angle_sr * radiosity[static_cast<std::size_t>(r.patch)]);
  return sum;
}

void AimedRays::add_harmonics(std::span<const std::uint32_t> aggregate_of, std::size_t aggregates, Bands bands,
                              float* rows) const {
  for (const AimedRay& r : ray) {
    if (r.patch < 0)
      continue;
    const auto y = bands == Bands::low      ? sh::evaluate9(r.direction)
                   : bands == Bands::fourth ? sh::evaluate_band4(r.direction)
                                            : axis_cosines(r.direction);
    float* to = rows + aggregate_of[static_cast<std::size_t>(r.patch)];
    for (std::size_t lm = 0; lm < 9; ++lm)
      to[lm * aggregates] += y[lm] * r.solid_angle_sr * std::numbers::inv_pi_v<float>;
  }
}

} // namespace daylit::radiosity
