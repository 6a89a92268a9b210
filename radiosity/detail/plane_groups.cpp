#include "radiosity/detail/plane_groups.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace daylit::radiosity {

namespace {

// Two faces are on one plane when their corners are within 2e-7 of the room of it: an order above the rounding of
// coordinates that a modelling program writes with seven digits, far below any real thickness. Normals must agree as
// well as the corners define them.
constexpr double kNormalTolerance = 1.4e-3; // radians
constexpr double kOffsetTolerance = 2e-7;
// Width of the cells in which planes of similar normal are looked up; at least twice the tolerance of the normals.
constexpr double kNormalCell = 1.0 / 64.0;

struct LocalTriangle {
  std::array<glm::dvec3, 3> corner;
  glm::dvec3 normal;
  double height_m; ///< the smallest of the three
  std::uint32_t material;
};

void set_axes(PlaneGroup& g) {
  const glm::dvec3 n = g.normal;
  const glm::dvec3 helper = std::abs(n.z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
  g.axis_u = glm::normalize(glm::cross(helper, n));
  g.axis_v = glm::cross(n, g.axis_u);
}

std::vector<LocalTriangle> reflecting_triangles(const Room& room, const glm::dvec3& origin) {
  std::vector<LocalTriangle> triangles;
  for (const RoomTriangle& t : room.triangles) {
    if (room.is_window(t))
      continue;
    LocalTriangle local{
        {room.corner(t, 0) - origin, room.corner(t, 1) - origin, room.corner(t, 2) - origin}, {}, 0.0, t.material};
    double longest = 0;
    for (int k = 0; k < 3; ++k)
      longest = std::max(longest, glm::distance(local.corner[k], local.corner[(k + 1) % 3]));
    const glm::dvec3 normal = glm::cross(local.corner[1] - local.corner[0], local.corner[2] - local.corner[0]);
    const double length = glm::length(normal);
    if (!(length > 0.0)) // on one line: receives and sends nothing
      continue;
    local.normal = normal / length;
    local.height_m = length / longest;
    triangles.push_back(local);
  }
  return triangles;
}

bool lies_in(const PlaneGroup& g, const LocalTriangle& t, double tolerance_m) {
  return std::ranges::all_of(
      t.corner, [&](const glm::dvec3& p) { return std::abs(glm::dot(p - g.point, g.normal)) <= tolerance_m; });
}

/// Finds the group of a triangle among those of similar normal.
class GroupIndex {
public:
  GroupIndex(std::vector<PlaneGroup>& groups, double tolerance_m) : groups_(groups), tolerance_m_(tolerance_m) {}

  /// Its corners say too little about its normal to look it up by it.
  bool is_sliver(const LocalTriangle& t) const { return normal_tolerance(t) > 0.5 * kNormalCell; }

  std::uint32_t group_of(const LocalTriangle& t) {
    std::uint32_t best = kNone;
    if (is_sliver(t)) {
      for (std::uint32_t g = 0; g < groups_.size() && best == kNone; ++g)
        best = same_plane(groups_[g], t) ? g : kNone;
    } else {
      for (const double side : {1.0, -1.0})
        for (int n = 0; n < 27; ++n)
          best = std::min(best, find_in(cell_of(side * t.normal) + glm::ivec3(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1), t));
    }
    return best == kNone ? add(t) : best;
  }

private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  /// Corners define the normal of a flat triangle no better than this, radians.
  double normal_tolerance(const LocalTriangle& t) const { return kNormalTolerance + 2.0 * tolerance_m_ / t.height_m; }
  bool same_plane(const PlaneGroup& g, const LocalTriangle& t) const {
    if (g.material != t.material || glm::length(glm::cross(g.normal, t.normal)) > normal_tolerance(t))
      return false;
    return lies_in(g, t, tolerance_m_);
  }

  static glm::ivec3 cell_of(const glm::dvec3& normal) { return glm::ivec3(glm::floor(normal / kNormalCell)); }
  static std::uint64_t key(const glm::ivec3& c) {
    const auto bits = [](int i) { return static_cast<std::uint64_t>(i + 1024); };
    return bits(c.x) << 42 | bits(c.y) << 21 | bits(c.z);
  }

  std::uint32_t find_in(const glm::ivec3& cell, const LocalTriangle& t) const {
    std::uint32_t best = kNone;
    const auto range = of_cell_.equal_range(key(cell));
    for (auto it = range.first; it != range.second; ++it)
      if (it->second < best && same_plane(groups_[it->second], t))
        best = it->second;
    return best;
  }

  std::uint32_t add(const LocalTriangle& t) {
    PlaneGroup g;
    g.point = t.corner[0];
    g.normal = t.normal;
    g.material = t.material;
    set_axes(g);
    groups_.push_back(std::move(g));
    const auto index = static_cast<std::uint32_t>(groups_.size() - 1);
    of_cell_.emplace(key(cell_of(t.normal)), index);
    return index;
  }

  std::vector<PlaneGroup>& groups_;
  double tolerance_m_;
  std::unordered_multimap<std::uint64_t, std::uint32_t> of_cell_;
};

/// Segment in which a triangle meets the group's plane, if any.
std::optional<std::array<glm::dvec2, 2>> contact(const PlaneGroup& g, const LocalTriangle& t, double tolerance_m) {
  std::array<double, 3> h;
  for (int k = 0; k < 3; ++k) {
    h[k] = glm::dot(t.corner[k] - g.point, g.normal);
    if (std::abs(h[k]) <= tolerance_m)
      h[k] = 0.0;
  }
  std::array<glm::dvec2, 4> hit;
  int hits = 0;
  for (int k = 0; k < 3; ++k) {
    const int n = (k + 1) % 3;
    if (h[k] == 0.0)
      hit[hits++] = g.flatten(t.corner[k]);
    else if (h[k] * h[n] < 0.0)
      hit[hits++] = g.flatten(glm::mix(t.corner[k], t.corner[n], h[k] / (h[k] - h[n])));
  }
  if (hits != 2) // apart, one touching corner, or lying in the plane
    return std::nullopt;
  return std::array<glm::dvec2, 2>{hit[0], hit[1]};
}

constexpr double kSmall_m = 0.3; // longest edge

using Flat = std::array<glm::dvec2, 3>;

/// Two triangles of one plane share more than a border: no side of either separates them.
bool overlap(const Flat& a, const Flat& b, double tolerance_m) {
  const auto parted = [&](const Flat& p, const Flat& q) {
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec2 &from = p[k], side = p[(k + 1) % 3] - from;
      const glm::dvec2 across = glm::dvec2(-side.y, side.x) / glm::length(side);
      const double inside = glm::dot(p[(k + 2) % 3] - from, across) < 0.0 ? -1.0 : 1.0;
      if (std::ranges::all_of(q,
                              [&](const glm::dvec2& c) { return inside * glm::dot(c - from, across) <= tolerance_m; }))
        return true;
    }
    return false;
  };
  return !parted(a, b) && !parted(b, a);
}

/// A face that lies on a group of another material hides that part of it.
void cover(PlaneGroup& g, const LocalTriangle& t, double tolerance_m) {
  const Flat flat = {g.flatten(t.corner[0]), g.flatten(t.corner[1]), g.flatten(t.corner[2])};
  if (std::ranges::none_of(g.triangles, [&](const Flat& own) { return overlap(own, flat, tolerance_m); }))
    return;
  g.covered.push_back(flat);
  for (std::size_t k = 0; k < 3; ++k)
    g.contacts.push_back({flat[k], flat[(k + 1) % 3]});
}

/// Calls visit(i, j) for all pairs of triangles whose boxes, grown by the tolerance, overlap: a sweep along the axis
/// on which the boxes are thinnest together.
class BoxSweep {
public:
  BoxSweep(const std::vector<LocalTriangle>& triangles, double tolerance_m) {
    glm::dvec3 widths(0.0);
    for (const LocalTriangle& t : triangles) {
      const auto& [a, b, c] = t.corner;
      boxes_.push_back({glm::min(a, glm::min(b, c)) - tolerance_m, glm::max(a, glm::max(b, c)) + tolerance_m,
                        static_cast<std::uint32_t>(boxes_.size())});
      widths += boxes_.back().hi - boxes_.back().lo;
    }
    axis_ = widths.x <= widths.y && widths.x <= widths.z ? 0 : widths.y <= widths.z ? 1 : 2;
    std::ranges::sort(boxes_, [this](const Box& a, const Box& b) {
      return a.lo[axis_] != b.lo[axis_] ? a.lo[axis_] < b.lo[axis_] : a.index < b.index;
    });
  }

  template <class Visit>
  void each_pair(const Visit& visit) const {
    std::vector<const Box*> open;
    for (const Box& box : boxes_) {
      std::erase_if(open, [&](const Box* o) { return o->hi[axis_] < box.lo[axis_]; });
      for (const Box* o : open)
        if (overlap(*o, box))
          visit(o->index, box.index);
      open.push_back(&box);
    }
  }

private:
  struct Box {
    glm::dvec3 lo, hi;
    std::uint32_t index;
  };
  static bool overlap(const Box& a, const Box& b) {
    return a.lo.x <= b.hi.x && b.lo.x <= a.hi.x && a.lo.y <= b.hi.y && b.lo.y <= a.hi.y && a.lo.z <= b.hi.z &&
           b.lo.z <= a.hi.z;
  }
  std::vector<Box> boxes_;
  int axis_ = 0;
};

/// A triangle by itself, as of curved surfaces, so small that it is not cut where it is partly inside something.
bool is_small(const PlaneGroup& g) {
  if (g.triangles.size() > 1)
    return false;
  const Flat& t = g.triangles.front();
  return std::max({glm::length(t[1] - t[0]), glm::length(t[2] - t[1]), glm::length(t[0] - t[2])}) < kSmall_m;
}

void add_contacts(const std::vector<LocalTriangle>& triangles, const std::vector<std::uint32_t>& group_of,
                  double tolerance_m, std::vector<PlaneGroup>& groups) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> touching; // group, triangle
  BoxSweep(triangles, tolerance_m).each_pair([&](std::uint32_t i, std::uint32_t j) {
    if (group_of[i] == group_of[j])
      return;
    touching.emplace_back(group_of[i], j);
    touching.emplace_back(group_of[j], i);
  });
  std::ranges::sort(touching);
  const auto repeated = std::ranges::unique(touching);
  touching.erase(repeated.begin(), repeated.end());
  for (const auto& [g, i] : touching) {
    if (is_small(groups[g]))
      continue;
    if (const auto segment = contact(groups[g], triangles[i], tolerance_m))
      groups[g].contacts.push_back(*segment);
    else if (group_of[i] < g && groups[group_of[i]].material != groups[g].material &&
             lies_in(groups[g], triangles[i], tolerance_m))
      cover(groups[g], triangles[i], tolerance_m);
  }
}

} // namespace

glm::dvec2 PlaneGroup::flatten(const glm::dvec3& p) const {
  return {glm::dot(p - point, axis_u), glm::dot(p - point, axis_v)};
}

std::vector<PlaneGroup> group_planes(const Room& room, const glm::dvec3& origin) {
  const glm::dvec3 size = room.bounds().size();
  const double tolerance_m = kOffsetTolerance * std::max({size.x, size.y, size.z});
  const std::vector<LocalTriangle> triangles = reflecting_triangles(room, origin);
  std::vector<PlaneGroup> groups;
  GroupIndex index(groups, tolerance_m);
  std::vector<std::uint32_t> group_of(triangles.size());
  // Well-shaped faces define the planes; slivers join them, whatever the order in the file.
  std::vector<std::uint32_t> order(triangles.size());
  for (std::uint32_t i = 0; i < order.size(); ++i)
    order[i] = i;
  std::ranges::stable_partition(order, [&](std::uint32_t i) { return !index.is_sliver(triangles[i]); });
  for (const std::uint32_t i : order) {
    const LocalTriangle& t = triangles[i];
    group_of[i] = index.group_of(t);
    PlaneGroup& g = groups[group_of[i]];
    g.triangles.push_back({g.flatten(t.corner[0]), g.flatten(t.corner[1]), g.flatten(t.corner[2])});
  }
  add_contacts(triangles, group_of, tolerance_m, groups);
  return groups;
}

} // namespace daylit::radiosity
