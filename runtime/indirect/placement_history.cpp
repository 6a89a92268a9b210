#include "runtime/indirect/placement_history.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace daylit {

namespace {

/// The same object, wherever it stands.
bool is_same(const PlacedPart& a, const PlacedPart& b) {
  return a.rays == b.rays && a.positions.data() == b.positions.data() && a.positions.size() == b.positions.size() &&
         a.first_vertex == b.first_vertex && a.sender.data() == b.sender.data() &&
         a.mirror_normals.data() == b.mirror_normals.data() && a.glass == b.glass && a.transmittance == b.transmittance;
}

/// The cones in which x sees two spheres have a direction in common, and the first may lie before the second: it is
/// nearer than the far side of this.
bool may_lie_before(const BoundingSphere& a, const BoundingSphere& b, const glm::dvec3& x) {
  if (a.radius <= 0.0 || b.radius <= 0.0)
    return false;
  const glm::dvec3 to_a = a.centre - x, to_b = b.centre - x;
  const double away_a = glm::length(to_a), away_b = glm::length(to_b);
  if (away_a - a.radius >= away_b + b.radius)
    return false;
  if (away_a <= a.radius || away_b <= b.radius)
    return true;
  const double between = std::acos(std::clamp(glm::dot(to_a, to_b) / (away_a * away_b), -1.0, 1.0));
  return between <= std::asin(a.radius / away_a) + std::asin(b.radius / away_b);
}

} // namespace

void PlacementHistory::add(std::uint64_t version, const PlacedParts& parts) {
  std::vector<PlacedPart> objects;
  Placement placement{version, {}};
  for (std::size_t k = 0; k < parts.size(); ++k) {
    objects.push_back(parts.part(k));
    placement.parts.push_back({parts.part(k).world_from_object, parts.sphere(k)});
  }
  if (!std::ranges::equal(objects, objects_, is_same))
    placements_.clear();
  objects_ = std::move(objects);
  placements_.push_back(std::move(placement));
  if (placements_.size() > kKept)
    placements_.pop_front();
}

const PlacementHistory::Placement* PlacementHistory::at(std::uint64_t version) const {
  const auto found = std::ranges::lower_bound(placements_, version, {}, &Placement::version);
  return found != placements_.end() && found->version == version ? &*found : nullptr;
}

bool PlacementHistory::holds(std::size_t part, const glm::dvec3& x, std::uint64_t since) const {
  const Placement* const then = at(since);
  if (!then)
    return false;
  const Placement& now = placements_.back();
  const auto moved = [&](std::size_t k) { return then->parts[k].world_from_object != now.parts[k].world_from_object; };
  if (moved(part))
    return false;
  for (std::size_t k = 0; k < now.parts.size(); ++k)
    if (moved(k) && (may_lie_before(then->parts[k].sphere, now.parts[part].sphere, x) ||
                     may_lie_before(now.parts[k].sphere, now.parts[part].sphere, x)))
      return false;
  return true;
}

} // namespace daylit
