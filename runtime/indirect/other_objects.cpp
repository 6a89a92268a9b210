#include "runtime/indirect/other_objects.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/core/parallel.h"
#include "sh/sh9.h"

namespace daylit {

namespace {
constexpr int kRays = 64;                // from each point to each other object
constexpr double kInset = 0.05;          // of the box: floors and walls touch it
constexpr double kLeastFraction = 0.002; // of a cosine-weighted hemisphere

const DirectionPattern& pattern() {
  static const DirectionPattern made(kRays);
  return made;
}

/// As seen from some point in `sphere`.
bool is_large(const BoundingSphere& other, const BoundingSphere& sphere) {
  const double nearest = glm::length(other.centre - sphere.centre) - sphere.radius;
  return other.radius > 0.0 &&
         (nearest <= other.radius || other.radius * other.radius > kLeastFraction * nearest * nearest);
}
} // namespace

void OtherObjects::set_objects(const PlacedParts& parts) {
  parts_ = &parts;
  traced_ = false;
  lattices_.assign(parts.size(), {});
  for (std::size_t part = 0; part < parts.size(); ++part)
    for (std::size_t other = 0; other < parts.size(); ++other)
      if (other != part && !parts.box(part).empty() && is_large(parts.sphere(other), parts.sphere(part)))
        lattices_[part].others.push_back(other);
  for (std::size_t part = 0; part < parts.size(); ++part)
    if (!lattices_[part].others.empty())
      mark_used(part);
}

OtherObjects::Cell OtherObjects::cell_of(std::size_t part, const glm::dvec3& own) const {
  const Bounds& box = parts_->box(part);
  const glm::dvec3 size = glm::max(box.size(), glm::dvec3(1e-9));
  const glm::dvec3 p =
      glm::clamp(((own - box.min) / size - kInset) / (1.0 - 2.0 * kInset), 0.0, 1.0) * double{kSide - 1};
  const glm::ivec3 lower = glm::min(glm::ivec3(p), glm::ivec3(kSide - 2));
  return {lower, glm::vec3(p - glm::dvec3(lower))};
}

std::size_t OtherObjects::corner(const Cell& cell, int k) {
  const glm::ivec3 at = cell.lower + glm::ivec3(k & 1, k >> 1 & 1, k >> 2);
  return static_cast<std::size_t>((at.z * kSide + at.y) * kSide + at.x);
}

void OtherObjects::mark_used(std::size_t part) {
  for (const glm::vec3& p : parts_->positions(part)) {
    const Cell cell = cell_of(part, glm::dvec3(p));
    for (int k = 0; k < 8; ++k)
      lattices_[part].points[corner(cell, k)].used = true;
  }
}

bool OtherObjects::any() const {
  return std::any_of(lattices_.begin(), lattices_.end(), [](const Lattice& l) { return !l.others.empty(); });
}

glm::dvec3 OtherObjects::position(std::size_t part, std::size_t point) const {
  const glm::dvec3 step(point % kSide, point / kSide % kSide, point / (kSide * kSide));
  const Bounds& box = parts_->box(part);
  return parts_->to_world(part, box.min + (kInset + (1.0 - 2.0 * kInset) / (kSide - 1) * step) * box.size());
}

/// The object itself hides nothing here: that is in its transfer vectors.
void OtherObjects::look_around(std::size_t part, std::size_t which) {
  LatticePoint& point = lattices_[part].points[which];
  const glm::dvec3 x = position(part, which);
  float all = 0.0f, from_behind = 0.0f;
  for (const std::size_t other : lattices_[part].others)
    find_occluded_by(rays_, patches_, *parts_, {other, part}, x, pattern(), point.covered);
  for (const OccludedDirection& c : point.covered) {
    all += c.weight;
    from_behind += c.object.back ? c.weight : 0.0f;
  }
  point.open = from_behind <= 0.5f * all;
}

Sh9Rgb OtherObjects::change_at(const LatticePoint& point, const glm::dvec3& x,
                               std::span<const TwoSided> radiance) const {
  Sh9Rgb sum{};
  for (std::size_t k = 0; k < point.covered.size(); ++k) {
    const OccludedDirection& c = point.covered[k];
    Rgb change = object_radiance(c, radiance);
    if (c.behind)
      change -= c.behind->reflectance * patches_.irradiance(*c.behind) * std::numbers::inv_pi_v<float> +
                sunlight_behind(c, k, windows_);
    const std::array<float, 9> y = sh::evaluate9(glm::vec3(glm::normalize(c.position - x)));
    for (int i = 0; i < 9; ++i)
      sum[i] += c.weight * y[i] * change;
  }
  return sum;
}

void OtherObjects::set_light(std::span<const TwoSided> radiance) {
  const bool trace = !std::exchange(traced_, true);
  constexpr std::size_t kPoints = kSide * kSide * kSide;
  parallel_for(std::size_t{0}, kPoints * lattices_.size(), [&](std::size_t k) {
    Lattice& lattice = lattices_[k / kPoints];
    LatticePoint& point = lattice.points[k % kPoints];
    if (!point.used)
      return;
    if (trace)
      look_around(k / kPoints, k % kPoints);
    point.change = change_at(point, position(k / kPoints, k % kPoints), radiance);
  });
}

Sh9Rgb OtherObjects::change(std::size_t part, const glm::dvec3& x) const {
  const Lattice& lattice = lattices_[part];
  Sh9Rgb sum{};
  if (lattice.others.empty())
    return sum;
  const Cell cell = cell_of(part, parts_->to_own(part, x));
  const glm::vec3& t = cell.fraction;
  float whole = 0.0f;
  for (int k = 0; k < 8; ++k) {
    const LatticePoint& point = lattice.points[corner(cell, k)];
    if (!point.open)
      continue;
    const float weight = (k & 1 ? t.x : 1 - t.x) * (k & 2 ? t.y : 1 - t.y) * (k & 4 ? t.z : 1 - t.z);
    whole += weight;
    for (int i = 0; i < 9; ++i)
      sum[i] += weight * point.change[i];
  }
  for (Rgb& c : sum)
    c *= whole > 0.0f ? 1.0f / whole : 0.0f;
  return sum;
}

} // namespace daylit
