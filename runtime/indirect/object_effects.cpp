#include "runtime/indirect/object_effects.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <glm/geometric.hpp>

#include "runtime/sky/window_sampler.h"
#include "scene/core/parallel.h"
#include "sh/sh9.h"

namespace daylit {

namespace {

constexpr int kSide = 8;                 // points of the lattice
constexpr int kRays = 64;                // from each point to each other object
constexpr double kInset = 0.05;          // of the box: floors and walls touch it
constexpr double kLeastFraction = 0.002; // of a cosine-weighted hemisphere
constexpr double kContact = 0.8; // of the radius of the smaller object: nearer to another a vertex looks for itself
constexpr double kLift = 0.001;  // the same: off the surface that the vertex may lie on

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

/// More than half of what x sees of the others is their back: it lies inside one.
bool is_inside(std::span<const OccludedDirection> covered) {
  float all = 0.0f, from_behind = 0.0f;
  for (const OccludedDirection& c : covered) {
    all += c.weight;
    from_behind += c.object.back ? c.weight : 0.0f;
  }
  return from_behind > 0.5f * all;
}

} // namespace

/// On all used points of all lattices, in parallel: work(part, x, point).
template <class Work>
void OtherObjects::for_each_used(const Work& work) {
  constexpr std::size_t kPoints = kSide * kSide * kSide;
  parallel_for(std::size_t{0}, kPoints * surrounds_.size(), [&](std::size_t k) {
    const std::size_t part = k / kPoints;
    Surround& s = surrounds_[part];
    if (LatticePoint& point = s.points[k % kPoints]; point.used)
      work(part, parts_->to_world(part, s.lattice.position(k % kPoints)), point);
  });
}

void OtherObjects::set_objects(const PlacedParts& parts) {
  parts_ = &parts;
  room_known_ = false;
  surrounds_.clear();
  for (std::size_t part = 0; part < parts.size(); ++part) {
    Surround s{BoxLattice(parts.box(part), kSide, kInset), {}, {}};
    s.points.resize(s.lattice.point_count());
    for (std::size_t other = 0; other < parts.size(); ++other)
      if (other != part && !parts.box(part).empty() && is_large(parts.sphere(other), parts.sphere(part)))
        s.others.push_back(other);
    if (!s.others.empty())
      for (const std::uint32_t v : parts.senders(part))
        for (const BoxLattice::Corner& c : s.lattice.around(glm::dvec3(parts.positions(part)[v])))
          s.points[c.point].used = true;
    surrounds_.push_back(std::move(s));
  }
  for_each_used([&](std::size_t part, const glm::dvec3& x, LatticePoint& point) { look_around(part, x, point); });
}

/// Objects that are small, or far from each other, are left out.
bool OtherObjects::any() const {
  return std::any_of(surrounds_.begin(), surrounds_.end(), [](const Surround& s) { return !s.others.empty(); });
}

/// The object itself hides nothing here: that is in its transfer vectors.
void OtherObjects::look_around(std::size_t part, const glm::dvec3& x, LatticePoint& point) const {
  for (const std::size_t other : surrounds_[part].others)
    find_occluded_by(rays_, patches_, *parts_, {other, part}, x, pattern(), point.occluded);
  for (const OccludedDirection& c : point.occluded) {
    std::array<float, 9>& weight = point.weight.emplace_back(sh::evaluate9(glm::vec3(glm::normalize(c.position - x))));
    for (float& w : weight)
      w *= c.weight;
  }
  point.open = !is_inside(point.occluded);
}

/// rho E / pi + L_sun; sky counts as zero, for it is the direct shadow's.
Rgb OtherObjects::behind(const OccludedDirection& c, std::size_t k) const {
  return c.behind ? c.behind->reflectance * patches_.irradiance(*c.behind) * std::numbers::inv_pi_v<float> +
                        sunlight_behind(c, k, windows_, *parts_)
                  : Rgb(0.0f);
}

void OtherObjects::look_behind(LatticePoint& point) const {
  point.behind.resize(point.occluded.size());
  for (std::size_t k = 0; k < point.occluded.size(); ++k)
    point.behind[k] = behind(point.occluded[k], k);
}

/// Delta L_lm = sum over the occluded directions of dw Y_lm(w) (L_object - L_behind).
/// Solid angle, not cosine: the transfer vectors of the vertices hold the cosine.
Sh9Rgb OtherObjects::change_at(const LatticePoint& point, std::span<const TwoSided> radiance) {
  Sh9Rgb sum{};
  for (std::size_t k = 0; k < point.occluded.size(); ++k) {
    const Rgb change = object_radiance(point.occluded[k], radiance) - point.behind[k];
    for (std::size_t i = 0; i < 9; ++i)
      sum[i] += point.weight[k][i] * change;
  }
  return sum;
}

void OtherObjects::set_light(std::span<const TwoSided> radiance) {
  const bool known = std::exchange(room_known_, true);
  for_each_used([&](std::size_t, const glm::dvec3&, LatticePoint& point) {
    if (!known)
      look_behind(point);
    point.change = change_at(point, radiance);
  });
}

/// Trilinear between the points that are not inside another object.
Sh9Rgb OtherObjects::change(std::size_t part, const glm::dvec3& x) const {
  const Surround& s = surrounds_[part];
  Sh9Rgb sum{};
  if (s.others.empty())
    return sum;
  float whole = 0.0f;
  for (const BoxLattice::Corner& c : s.lattice.around(parts_->to_own(part, x))) {
    const LatticePoint& point = s.points[c.point];
    if (!point.open)
      continue;
    whole += c.weight;
    for (int i = 0; i < 9; ++i)
      sum[i] += c.weight * point.change[i];
  }
  for (Rgb& c : sum)
    c *= whole > 0.0f ? 1.0f / whole : 0.0f;
  return sum;
}

/// The share falls from 1 at half of kContact to 0 there.
ContactView OtherObjects::contact_view(std::size_t part, const glm::dvec3& x, const SenderSide& side) const {
  ContactView view;
  double share = 0.0;
  for (const std::size_t other : surrounds_[part].others) {
    const double radius = std::min(parts_->sphere(part).radius, parts_->sphere(other).radius),
                 reach = kContact * radius;
    share = std::max(share, std::clamp(2.0 - 2.0 * parts_->distance(other, x, reach) / reach, 0.0, 1.0));
  }
  if (share <= 0.0)
    return view;
  const glm::dvec3 n(side.world_from_local[2]);
  const glm::dvec3 lifted = x + kLift * parts_->sphere(part).radius * (n + glm::dvec3(0.0, 0.0, 1.0));
  find_others(
      rays_, patches_, *parts_, part, lifted, n, [&](const glm::vec3& w) { return side.visible_cosine(w); }, pattern(),
      view.covered);
  if (is_inside(view.covered))
    return {};
  view.share = static_cast<float>(share);
  view.blocked = windows_.blocked_fraction(lifted, n, *parts_, part);
  return view;
}

/// Delta E = sum over the covered directions of V cos dw (L_object - L_behind).
Rgb OtherObjects::change(const ContactView& view, std::span<const TwoSided> radiance) const {
  Rgb sum(0.0f);
  for (std::size_t k = 0; k < view.covered.size(); ++k)
    sum += view.covered[k].weight * (object_radiance(view.covered[k], radiance) - behind(view.covered[k], k));
  return sum;
}

} // namespace daylit
