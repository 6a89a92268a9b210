#include "runtime/indirect/indirect_feedback.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include <glm/geometric.hpp>

#include "runtime/base/cell_key.h"
#include "runtime/object/ray_fan.h"
#include "runtime/sky/window_sampler.h"
#include "scene/core/parallel.h"
#include "sh/sh9.h"

namespace daylit {

namespace {
constexpr int kSide = 8;        // points of the lattice
constexpr int kDirections = 48; // from each
constexpr int kPhases = 8;      // sets of directions: the points around a vertex have one each
constexpr double kInset = 0.02; // of the box: floors and walls touch it
constexpr int kPacket = 16;     // rays
static_assert(kDirections % kPacket == 0);

// All in radii of the object:
constexpr double kContact = 0.08;   // a vertex nearer than that to the room has an eye of its own,
constexpr double kEyeCell = 0.0125; // one for those that lie in the same cube of that side;
constexpr double kLift = 0.001;     // off the surface that the vertex may lie on;
constexpr double kCoarseCell = 0.25;

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

void IndirectFeedback::objects_moved() {
  surrounds_.clear();
  eyes_.clear();
  for (std::size_t part = 0; part < scene_.parts.size(); ++part) {
    surrounds_.push_back({BoxLattice(scene_.parts.box(part), kSide, kInset), {}, {}});
    add_lattice(part, surrounds_.back());
    add_contact(part, surrounds_.back());
  }
  parallel_for(std::size_t{0}, eyes_.size(), [&](std::size_t k) { look_around(eyes_[k]); });
  list_nodes();
  std::size_t seen = 0;
  for (Eye& eye : eyes_)
    eye.first = std::exchange(seen, seen + eye.seen.size());
  arriving_.assign(seen, Rgb(0.0f));
}

void IndirectFeedback::add_lattice(std::size_t part, Surround& surround) {
  surround.eye.assign(surround.lattice.point_count(), kNone);
  for (const std::uint32_t v : scene_.parts.senders(part))
    for (const BoxLattice::Corner& c : surround.lattice.around(glm::dvec3(scene_.parts.positions(part)[v]))) {
      if (surround.eye[c.point] != kNone)
        continue;
      surround.eye[c.point] = static_cast<std::uint32_t>(eyes_.size());
      const std::size_t k = c.point, phase = k % 2 + k / kSide % 2 * 2 + k / (kSide * kSide) % 2 * 4;
      const glm::dvec3 at = scene_.parts.to_world(part, surround.lattice.position(k));
      eyes_.push_back({part, at, static_cast<int>(phase), false, {}, {}, 0, {}});
    }
}

/// The distance to the room is found for coarse cells first: most of a dense mesh is far from it.
void IndirectFeedback::add_contact(std::size_t part, Surround& surround) {
  const double radius = scene_.parts.sphere(part).radius, reach = kContact * radius, coarse = kCoarseCell * radius;
  if (radius <= 0.0)
    return;
  const auto distance = [&](const glm::dvec3& x, double within) {
    return static_cast<double>(scene_.rays.distance(scene_.rays.to_local(x), static_cast<float>(within)));
  };
  const std::span<const glm::vec3> positions = scene_.parts.positions(part);
  std::map<CellKey, bool> is_near;
  std::map<CellKey, std::uint32_t> eye_of;
  surround.contact.assign(positions.size(), {});
  for (const std::uint32_t v : scene_.parts.senders(part)) {
    const glm::dvec3 x = scene_.parts.to_world(part, glm::dvec3(positions[v]));
    const CellKey cell(x, coarse);
    auto known = is_near.find(cell);
    if (known == is_near.end())
      known = is_near.emplace(cell, distance(cell.centre(coarse), coarse + reach) < 0.9 * coarse + reach).first;
    const double away = known->second ? distance(x, reach) : reach;
    const double t = std::clamp(4.0 - 4.0 * away / reach, 0.0, 1.0);
    if (t <= 0.0)
      continue;
    const auto [eye, made] = eye_of.emplace(CellKey(x, kEyeCell * radius), static_cast<std::uint32_t>(eyes_.size()));
    if (made)
      eyes_.push_back({part, x, 0, true, {}, {}, 0, {}});
    surround.contact[v] = {eye->second, static_cast<float>(t)};
  }
}

void IndirectFeedback::list_nodes() {
  std::vector<std::uint8_t> listed(receivers_.node_count(), 0);
  changes_.assign(listed.size(), Rgb(0.0f));
  nodes_.clear();
  for (Eye& eye : eyes_)
    for (ReceiverLattice::Node* node : std::exchange(eye.nodes, {}))
      if (!std::exchange(listed[receivers_.number_of(*node)], 1))
        nodes_.push_back(node);
}

void IndirectFeedback::see(Eye& eye, std::uint32_t direction, const Rgb& reflectance,
                           const ReceiverLattice::Link& link) const {
  SeenPoint& seen = eye.seen.emplace_back();
  seen.direction = direction;
  seen.reflectance = reflectance;
  seen.weight = link.weight;
  for (std::size_t k = 0; k < 4; ++k) {
    if (link.weight[k] == 0.0f)
      continue;
    seen.node[k] = static_cast<std::uint32_t>(receivers_.number_of(*link.node[k]));
    eye.nodes.push_back(link.node[k]);
  }
}

/// Evenly over the sphere of directions. The room is looked at as if the object did not stand there: what it hides is
/// in its transfer vectors.
void IndirectFeedback::look_around(Eye& eye) const {
  const BoundingSphere& sphere = scene_.parts.sphere(eye.part);
  const glm::vec3 from =
      scene_.rays.to_local(eye.position + glm::dvec3(0.0, 0.0, kLift * sphere.radius * eye.at_contact));
  const std::size_t start = static_cast<std::size_t>(eye.phase) * kDirections;
  for (std::size_t first = start; first < start + kDirections; first += kPacket) {
    RayHits16 hits;
    const std::uint32_t met = scene_.rays.closest16(
        ray_fan(from, kPacket, [&](std::size_t k) { return glm::vec3(directions().w[first + k]); }), kPacket, hits);
    for (std::size_t k = 0; k < kPacket; ++k) {
      if (!(met >> k & 1u))
        continue;
      const glm::dvec3& w = directions().w[first + k];
      const double distance = static_cast<double>(hits.distance[k]);
      const glm::dvec3 position = eye.position + distance * w;
      if (glm::length(position - sphere.centre) < kFeedbackRadii * sphere.radius &&
          (scene_.parts.size() == 1 || !scene_.parts.hidden(eye.position, w, distance, eye.part))) // see OtherObjects
        see(eye, static_cast<std::uint32_t>(first + k), scene_.reflectance(hits.triangle[k]),
            receivers_.link(hits.triangle[k], position, w, eye.at_contact ? distance / sphere.radius : kFeedbackRadii));
    }
  }
}

/// From each direction dw rho / pi Delta E of the point seen there, and Delta L_lm = sum of that times Y_lm.
void IndirectFeedback::find_change(Eye& eye) {
  constexpr float kWeight = 4.0f / kDirections; // 4 pi sr between the directions, over pi
  eye.change = {};
  for (std::size_t j = 0; j < eye.seen.size(); ++j) {
    const SeenPoint& p = eye.seen[j];
    Rgb change(0.0f);
    for (std::size_t k = 0; k < 4; ++k)
      change += p.weight[k] * changes_[p.node[k]];
    const Rgb radiance = arriving_[eye.first + j] = kWeight * p.reflectance * change;
    const std::array<float, 9>& y = directions().harmonics[p.direction];
    for (int i = 0; i < 9; ++i)
      eye.change[i] += y[i] * radiance;
  }
}

void IndirectFeedback::light_changed(bool sun_too) {
  parallel_for(tbb::blocked_range<std::size_t>(0, nodes_.size(), 16), [&](const auto& range) {
    for (std::size_t k = range.begin(); k != range.end(); ++k)
      changes_[receivers_.number_of(*nodes_[k])] = receivers_.whole_change(*nodes_[k], sun_too);
  });
  parallel_for(tbb::blocked_range<std::size_t>(0, eyes_.size(), 16), [&](const auto& range) {
    for (std::size_t k = range.begin(); k != range.end(); ++k)
      find_change(eyes_[k]);
  });
}

/// The points of the lattice around it, mixed with its own.
template <class Add>
void IndirectFeedback::for_each_eye(std::size_t part, std::size_t vertex, const Add& add) const {
  const Surround& s = surrounds_[part];
  const Contact own = s.contact.empty() ? Contact{} : s.contact[vertex];
  if (own.eye != kNone)
    add(eyes_[own.eye], own.weight);
  if (own.weight < 1.0f)
    for (const BoxLattice::Corner& c : s.lattice.around(glm::dvec3(scene_.parts.positions(part)[vertex])))
      add(eyes_[s.eye[c.point]], (1.0f - own.weight) * c.weight);
}

/// L_lm(x) = sum_k w_k L_lm,k.
Sh9Rgb IndirectFeedback::change(std::size_t part, std::size_t vertex) const {
  Sh9Rgb sum{};
  for_each_eye(part, vertex, [&](const Eye& eye, float weight) {
    for (int i = 0; i < 9; ++i)
      sum[i] += weight * eye.change[i];
  });
  return sum;
}

/// w_k V cos of each direction in which point k sees the room.
std::vector<FeedbackTerm> IndirectFeedback::terms(std::size_t part, std::size_t vertex, const SenderSide& side) const {
  std::vector<FeedbackTerm> terms;
  for_each_eye(part, vertex, [&](const Eye& eye, float weight) {
    for (std::size_t j = 0; weight > 0.0f && j < eye.seen.size(); ++j)
      if (const float cosine = side.visible_cosine(glm::vec3(directions().w[eye.seen[j].direction])); cosine > 0.0f)
        terms.push_back({static_cast<std::uint32_t>(eye.first + j), weight * cosine});
  });
  return terms;
}

Rgb IndirectFeedback::change(std::span<const FeedbackTerm> terms) const {
  Rgb sum(0.0f);
  for (const FeedbackTerm& t : terms)
    sum += t.weight * arriving_[t.light];
  return sum;
}

} // namespace daylit
