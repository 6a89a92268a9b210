#include "runtime/indirect/indirect_feedback.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/sky/window_sampler.h"
#include "scene/core/parallel.h"
#include "sh/sh9.h"

namespace daylit {

namespace {
constexpr int kDirections = 128;  // from each point
constexpr double kInset = 0.1;    // of the box: its eight points lie inside
constexpr double kFarRadii = 4.0; // shadows further away are not looked for
} // namespace

void IndirectFeedback::set_objects(const PlacedParts& parts) {
  parts_ = &parts;
  surrounds_.assign(parts.size(), {});
  parallel_for(std::size_t{0}, 8 * parts.size(),
               [&](std::size_t k) { surrounds_[k / 8].seen[k % 8] = look_around(k / 8, static_cast<int>(k % 8)); });
}

/// The room is looked at as if the object did not stand there: what it hides is in its transfer vectors.
std::vector<IndirectFeedback::SeenPoint> IndirectFeedback::look_around(std::size_t part, int corner) const {
  std::vector<SeenPoint> seen;
  const Bounds& box = parts_->box(part);
  if (box.empty())
    return seen;
  const glm::dvec3 t(corner & 1 ? 1 - kInset : kInset, corner & 2 ? 1 - kInset : kInset,
                     corner & 4 ? 1 - kInset : kInset);
  const glm::dvec3 eye = parts_->to_world(part, box.min + t * box.size());
  const BoundingSphere& sphere = parts_->sphere(part);
  for (int i = 0; i < kDirections; ++i) {
    const glm::dvec2 u = lattice_point(i, kDirections);
    const double z = 1.0 - 2.0 * u.x, r = std::sqrt(std::max(0.0, 1.0 - z * z)), turn = 2.0 * std::numbers::pi * u.y;
    const glm::dvec3 w(r * std::cos(turn), r * std::sin(turn), z);
    RayHit hit;
    if (!rays_.closest(rays_.to_local(eye), glm::vec3(w), 0.0f, std::numeric_limits<float>::infinity(), hit))
      continue;
    const glm::dvec3 n = planes_[planes_.facing_of(hit.triangle, w)].normal;
    const glm::dvec3 position = eye + static_cast<double>(hit.distance) * w, air = position + kAirGap_m * n;
    if (glm::length(position - sphere.centre) < kFarRadii * sphere.radius &&
        !parts_->hidden(eye, w, static_cast<double>(hit.distance), part)) // by another: see OtherObjects
      seen.push_back({hit.triangle, position, w, windows_.blocked_fraction(air, n, *parts_)});
  }
  return seen;
}

Sh9Rgb IndirectFeedback::change_of(const std::vector<SeenPoint>& seen) const {
  constexpr float kWeight = 4.0f / kDirections; // 4 pi sr between the directions, over pi
  Sh9Rgb sum{};
  for (const SeenPoint& p : seen) {
    const RoomPoint point = light_.at_surface(p.triangle, p.position, p.direction);
    const glm::dvec3 n = planes_[planes_.facing_of(p.triangle, p.direction)].normal;
    const Rgb lost =
        p.blocked_fraction * point.open_sky_irradiance + windows_.lost_sun(p.position + kAirGap_m * n, n, *parts_);
    const std::array<float, 9> y = sh::evaluate9(glm::vec3(p.direction));
    for (int i = 0; i < 9; ++i)
      sum[i] -= kWeight * y[i] * point.reflectance * lost;
  }
  return sum;
}

void IndirectFeedback::set_frame() {
  parallel_for(std::size_t{0}, 8 * surrounds_.size(),
               [&](std::size_t k) { surrounds_[k / 8].change[k % 8] = change_of(surrounds_[k / 8].seen[k % 8]); });
}

Sh9Rgb IndirectFeedback::change(std::size_t part, const glm::dvec3& x) const {
  const Bounds& box = parts_->box(part);
  const glm::dvec3 size = glm::max(box.size(), glm::dvec3(1e-9));
  const glm::dvec3 t =
      glm::clamp(((parts_->to_own(part, x) - box.min) / size - kInset) / (1.0 - 2.0 * kInset), 0.0, 1.0);
  Sh9Rgb sum{};
  for (int k = 0; k < 8; ++k) {
    const double weight = (k & 1 ? t.x : 1 - t.x) * (k & 2 ? t.y : 1 - t.y) * (k & 4 ? t.z : 1 - t.z);
    for (int i = 0; i < 9; ++i)
      sum[i] += static_cast<float>(weight) * surrounds_[part].change[k][i];
  }
  return sum;
}

} // namespace daylit
