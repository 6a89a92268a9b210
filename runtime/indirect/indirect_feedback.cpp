#include "runtime/indirect/indirect_feedback.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

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
  surrounds_.clear();
  for (std::size_t part = 0; part < parts.size(); ++part)
    surrounds_.push_back({BoxLattice(parts.box(part), 2, kInset), {}, {}});
  parallel_for(std::size_t{0}, 8 * parts.size(), [&](std::size_t k) {
    Surround& s = surrounds_[k / 8];
    if (!parts.box(k / 8).empty())
      s.seen[k % 8] = look_around(k / 8, parts.to_world(k / 8, s.lattice.position(k % 8)));
  });
}

/// Evenly over the sphere of directions. The room is looked at as if the object did not stand there: what it hides is
/// in its transfer vectors.
std::vector<IndirectFeedback::SeenPoint> IndirectFeedback::look_around(std::size_t part, const glm::dvec3& eye) const {
  std::vector<SeenPoint> seen;
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

/// Delta L_lm = - sum over the directions of dw Y_lm(w) rho / pi (E_sky lost + E_sun lost) of the point seen there.
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

/// Nothing is traced but the sun's shadow rays: what the points see of the windows is kept.
void IndirectFeedback::set_frame() {
  parallel_for(std::size_t{0}, 8 * surrounds_.size(),
               [&](std::size_t k) { surrounds_[k / 8].change[k % 8] = change_of(surrounds_[k / 8].seen[k % 8]); });
}

/// L_lm(x) = sum_k w_k L_lm,k of the eight points.
Sh9Rgb IndirectFeedback::change(std::size_t part, const glm::dvec3& x) const {
  const Surround& s = surrounds_[part];
  Sh9Rgb sum{};
  for (const BoxLattice::Corner& c : s.lattice.around(parts_->to_own(part, x)))
    for (int i = 0; i < 9; ++i)
      sum[i] += c.weight * s.change[c.point][i];
  return sum;
}

} // namespace daylit
