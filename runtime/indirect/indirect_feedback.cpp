#include "runtime/indirect/indirect_feedback.h"

#include <cmath>
#include <numbers>
#include <utility>

#include <glm/geometric.hpp>

#include "runtime/object/ray_fan.h"
#include "runtime/sky/window_sampler.h"
#include "scene/core/parallel.h"
#include "sh/sh9.h"

namespace daylit {

namespace {
constexpr int kSide = 8;          // points of the lattice
constexpr int kDirections = 48;   // from each
constexpr int kPhases = 8;        // sets of directions: the points around a vertex have one each
constexpr double kInset = 0.02;   // of the box: floors and walls touch it
constexpr double kFarRadii = 2.5; // a change further away is not looked for
constexpr int kPacket = 16;       // rays
static_assert(kDirections % kPacket == 0);

/// Evenly over the sphere, one set after another, with the nine harmonics of each.
struct Directions {
  std::vector<glm::dvec3> w;
  std::vector<std::array<float, 9>> harmonics;
};

const Directions& directions() {
  static const Directions made = [] {
    Directions d;
    for (int i = 0; i < kPhases * kDirections; ++i) {
      const double part = static_cast<double>(i / kDirections) / kPhases;
      const glm::dvec2 u =
          glm::fract(lattice_point(i % kDirections, kDirections) + glm::dvec2(part, part / kDirections));
      const double z = 1.0 - 2.0 * u.x, r = std::sqrt(std::max(0.0, 1.0 - z * z)), turn = 2.0 * std::numbers::pi * u.y;
      d.w.emplace_back(r * std::cos(turn), r * std::sin(turn), z);
      d.harmonics.push_back(sh::evaluate9(glm::vec3(d.w.back())));
    }
    return d;
  }();
  return made;
}

} // namespace

/// On all used points of all lattices, in parallel: work(part, point number, point).
template <class Work>
void IndirectFeedback::for_each_used(const Work& work) {
  constexpr std::size_t kPoints = kSide * kSide * kSide;
  parallel_for(std::size_t{0}, kPoints * surrounds_.size(), [&](std::size_t k) {
    if (LatticePoint& point = surrounds_[k / kPoints].points[k % kPoints]; point.used)
      work(k / kPoints, k % kPoints, point);
  });
}

void IndirectFeedback::objects_moved() {
  const PlacedParts& parts = scene_.parts;
  surrounds_.clear();
  for (std::size_t part = 0; part < parts.size(); ++part) {
    Surround s{BoxLattice(parts.box(part), kSide, kInset), {}};
    s.points.resize(s.lattice.point_count());
    for (const glm::vec3& p : parts.positions(part))
      for (const BoxLattice::Corner& c : s.lattice.around(glm::dvec3(p)))
        s.points[c.point].used = true;
    surrounds_.push_back(std::move(s));
  }
  for_each_used([&](std::size_t part, std::size_t k, LatticePoint& point) {
    const std::size_t phase = k % 2 + k / kSide % 2 * 2 + k / (kSide * kSide) % 2 * 4;
    look_around(part, parts.to_world(part, surrounds_[part].lattice.position(k)), phase, point);
  });
  list_nodes();
}

void IndirectFeedback::list_nodes() {
  std::vector<std::uint8_t> listed(receivers_.node_count(), 0);
  changes_.assign(listed.size(), Rgb(0.0f));
  nodes_.clear();
  for (Surround& s : surrounds_)
    for (LatticePoint& point : s.points)
      for (ReceiverLattice::Node* node : std::exchange(point.nodes, {}))
        if (!std::exchange(listed[receivers_.number_of(*node)], 1))
          nodes_.push_back(node);
}

void IndirectFeedback::see(LatticePoint& point, std::uint32_t direction, const Rgb& reflectance,
                           const ReceiverLattice::Link& link) const {
  SeenPoint& seen = point.seen.emplace_back();
  seen.direction = direction;
  seen.reflectance = reflectance;
  seen.weight = link.weight;
  for (std::size_t k = 0; k < 4; ++k) {
    if (link.weight[k] == 0.0f)
      continue;
    seen.node[k] = static_cast<std::uint32_t>(receivers_.number_of(*link.node[k]));
    point.nodes.push_back(link.node[k]);
  }
}

/// Evenly over the sphere of directions. The room is looked at as if the object did not stand there: what it hides is
/// in its transfer vectors.
void IndirectFeedback::look_around(std::size_t part, const glm::dvec3& eye, std::size_t phase,
                                   LatticePoint& point) const {
  const BoundingSphere& sphere = scene_.parts.sphere(part);
  const glm::vec3 from = scene_.rays.to_local(eye);
  for (std::size_t first = phase * kDirections; first < (phase + 1) * kDirections; first += kPacket) {
    RayHits16 hits;
    const std::uint32_t met = scene_.rays.closest16(
        ray_fan(from, kPacket, [&](std::size_t k) { return glm::vec3(directions().w[first + k]); }), kPacket, hits);
    for (std::size_t k = 0; k < kPacket; ++k) {
      if (!(met >> k & 1u))
        continue;
      const glm::dvec3& w = directions().w[first + k];
      const double distance = static_cast<double>(hits.distance[k]);
      const glm::dvec3 position = eye + distance * w;
      if (glm::length(position - sphere.centre) < kFarRadii * sphere.radius &&
          (scene_.parts.size() == 1 || !scene_.parts.hidden(eye, w, distance, part))) // by another: see OtherObjects
        see(point, static_cast<std::uint32_t>(first + k), scene_.reflectance(hits.triangle[k]),
            receivers_.link(hits.triangle[k], position, w));
    }
  }
}

/// Delta L_lm = sum over the directions of dw Y_lm(w) rho / pi Delta E of the point seen there.
Sh9Rgb IndirectFeedback::change_of(const std::vector<SeenPoint>& seen) const {
  constexpr float kWeight = 4.0f / kDirections; // 4 pi sr between the directions, over pi
  Sh9Rgb sum{};
  for (const SeenPoint& p : seen) {
    Rgb change(0.0f);
    for (std::size_t k = 0; k < 4; ++k)
      change += p.weight[k] * changes_[p.node[k]];
    const Rgb radiance = kWeight * p.reflectance * change;
    const std::array<float, 9>& y = directions().harmonics[p.direction];
    for (int i = 0; i < 9; ++i)
      sum[i] += y[i] * radiance;
  }
  return sum;
}

void IndirectFeedback::light_changed() {
  parallel_for(tbb::blocked_range<std::size_t>(0, nodes_.size(), 16), [&](const auto& range) {
    for (std::size_t k = range.begin(); k != range.end(); ++k)
      changes_[receivers_.number_of(*nodes_[k])] = receivers_.whole_change(*nodes_[k]);
  });
  for_each_used([&](std::size_t, std::size_t, LatticePoint& point) { point.change = change_of(point.seen); });
}

/// L_lm(x) = sum_k w_k L_lm,k of the points around.
Sh9Rgb IndirectFeedback::change(std::size_t part, const glm::dvec3& x) const {
  const Surround& s = surrounds_[part];
  Sh9Rgb sum{};
  for (const BoxLattice::Corner& c : s.lattice.around(scene_.parts.to_own(part, x)))
    for (int i = 0; i < 9; ++i)
      sum[i] += c.weight * s.points[c.point].change[i];
  return sum;
}

} // namespace daylit
