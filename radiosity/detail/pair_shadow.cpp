#include "radiosity/detail/pair_shadow.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <glm/geometric.hpp>

#include "radiosity/detail/pair_lanes.h"

namespace daylit::radiosity {

namespace {

constexpr std::size_t kMostEdges = 8; // of an obstacle

/// A convex polygon, or its part on one side of a plane: height over the plane and over every edge plane of its
/// corners.
struct Side {
  int size = 0;
  std::array<float, 6> height;
  std::array<std::array<float, kMostEdges>, 6> inside;
};

/// The part of a polygon of at most four corners above (sign 1) or below (-1) the plane.
Side part(const Side& whole, float sign, std::size_t edges) {
  Side out;
  const auto add = [&](float h, int a, int b, float t) {
    const auto to = static_cast<std::size_t>(out.size++), p = static_cast<std::size_t>(a),
               q = static_cast<std::size_t>(b);
    out.height[to] = h;
    for (std::size_t e = 0; e < edges; ++e)
      out.inside[to][e] = whole.inside[p][e] + t * (whole.inside[q][e] - whole.inside[p][e]);
  };
  for (int k = 0; k < whole.size; ++k) {
    const int next = (k + 1) % whole.size;
    const float h = whole.height[static_cast<std::size_t>(k)], g = whole.height[static_cast<std::size_t>(next)];
    if (sign * h >= 0.0f)
      add(h, k, k, 0.0f);
    if ((h > 0.0f && g < 0.0f) || (h < 0.0f && g > 0.0f))
      add(0.0f, k, next, h / (h - g));
  }
  return out;
}

/// All segments from one part to the part on the other side of the plane pass on the outer side of one edge.
bool passes_outside(const Side& a, const Side& b, std::size_t edges, float tolerance) {
  bool clear = a.size == 0 || b.size == 0;
  for (std::size_t e = 0; e < edges && !clear; ++e) {
    clear = true;
    for (std::size_t p = 0; p < static_cast<std::size_t>(a.size) && clear; ++p)
      for (std::size_t q = 0; q < static_cast<std::size_t>(b.size) && clear; ++q) {
        const float ha = std::abs(a.height[p]), hb = std::abs(b.height[q]);
        clear = ha * b.inside[q][e] + hb * a.inside[p][e] <= tolerance * (ha + hb);
      }
  }
  return clear;
}

/// Nothing of the obstacle stands between two polygons that its plane may cut.
bool parts_are_clear(const Side& a, const Side& b, std::size_t edges, float tolerance) {
  float low = a.height[0], high = low;
  for (const Side* side : {&a, &b})
    for (std::size_t k = 0; k < static_cast<std::size_t>(side->size); ++k) {
      low = std::min(low, side->height[k]);
      high = std::max(high, side->height[k]);
    }
  return low >= -tolerance || high <= tolerance ||
         (passes_outside(part(a, 1, edges), part(b, -1, edges), edges, tolerance) &&
          passes_outside(part(a, -1, edges), part(b, 1, edges), edges, tolerance));
}

} // namespace

/// Heights of all columns over the plane and the edge planes of every obstacle, once for the tile.
PairShadows::PairShadows(const PairArrays& arrays, const std::vector<Obstacle>& obstacles,
                         const std::vector<std::uint32_t>& used, const glm::dvec3& shift, std::uint32_t first,
                         std::uint32_t last, float tolerance_m)
    : arrays_(arrays), shift_(shift), first_(first), count_(last - first), tolerance_(tolerance_m), side_(count_),
      outside_(count_), inside_(count_) {
  const auto plane_of = [&](const glm::dvec3& normal, const glm::dvec3& point) {
    return Plane{static_cast<float>(normal.x), static_cast<float>(normal.y), static_cast<float>(normal.z),
                 static_cast<float>(glm::dot(normal, point + shift))};
  };
  for (const std::uint32_t k : used) {
    const Obstacle& o = obstacles[k];
    Prepared p{plane_of(o.normal, o.corner[0]), {}, {}, {}};
    p.height = heights(p.plane);
    for (std::size_t c = 0; c < o.corner.size(); ++c) {
      const glm::dvec3 along = o.corner[(c + 1) % o.corner.size()] - o.corner[c];
      const double length = glm::length(along);
      if (!(length > 0.0))
        continue;
      p.edge.push_back(plane_of(glm::cross(o.normal, along / length), o.corner[c]));
      p.inside.push_back(heights(p.edge.back()));
    }
    obstacles_.push_back(std::move(p));
  }
}

PairShadows::Heights PairShadows::heights(const Plane& p) const {
  Heights h(std::size_t{3} * count_);
  for (std::size_t c = 0; c < 3; ++c)
    for (std::uint32_t j = 0; j < count_; ++j)
      h[c * count_ + j] = p.at(arrays_.corner[3 * c][first_ + j], arrays_.corner[3 * c + 1][first_ + j],
                               arrays_.corner[3 * c + 2][first_ + j]);
  return h;
}

void PairShadows::row(std::uint32_t i, std::int32_t* shadow) {
  std::fill_n(shadow, count_, kClearPair);
  for (const Prepared& o : obstacles_)
    one_obstacle(o, i, shadow);
}

/// A pair stays clear while all its segments pass an obstacle on one side; an obstacle that all of them meet hides it,
/// whatever the others do; anything else is mixed.
void PairShadows::one_obstacle(const Prepared& o, std::uint32_t i, std::int32_t* shadow) {
  const auto against = [&](const Plane& p, const Heights& h) {
    CornerHeights a{{}, h.data(), h.data() + count_, h.data() + 2 * count_};
    for (std::size_t c = 0; c < 3; ++c)
      a.one[c] = p.at(arrays_.corner[3 * c][i], arrays_.corner[3 * c + 1][i], arrays_.corner[3 * c + 2][i]);
    return a;
  };
  const CornerHeights plane = against(o.plane, o.height);
  plane_sides(plane, count_, tolerance_, side_.data());
  for (std::uint32_t j = 0; j < count_; ++j) {
    outside_[j] = side_[j] == 2;
    inside_[j] = 1;
  }
  for (std::size_t e = 0; e < o.edge.size(); ++e)
    edge_sides(plane, against(o.edge[e], o.inside[e]), count_, tolerance_, side_.data(), outside_.data(),
               inside_.data());
  for (std::uint32_t j = 0; j < count_; ++j)
    if (!outside_[j] && shadow[j] != kHiddenPair) {
      if (inside_[j])
        shadow[j] = kHiddenPair;
      else if (side_[j] != 0 || !cut_pair_is_clear(o, i, j))
        shadow[j] = kMixedPair;
    }
}

/// The plane of the obstacle cuts a triangle: the parts above and below it are looked at one after the other.
bool PairShadows::cut_pair_is_clear(const Prepared& o, std::uint32_t i, std::uint32_t j) const {
  const std::size_t edges = o.edge.size();
  if (edges > kMostEdges)
    return false;
  Side one, column;
  one.size = column.size = 3;
  for (std::size_t c = 0; c < 3; ++c) {
    const float x = arrays_.corner[3 * c][i], y = arrays_.corner[3 * c + 1][i], z = arrays_.corner[3 * c + 2][i];
    one.height[c] = o.plane.at(x, y, z);
    column.height[c] = o.height[c * count_ + j];
    for (std::size_t e = 0; e < edges; ++e) {
      one.inside[c][e] = o.edge[e].at(x, y, z);
      column.inside[c][e] = o.inside[e][c * count_ + j];
    }
  }
  return parts_are_clear(one, column, edges, tolerance_);
}

bool PairShadows::clear(const SmallPolygon& a, const SmallPolygon& b) const {
  return std::ranges::all_of(obstacles_, [&](const Prepared& o) {
    const std::size_t edges = o.edge.size();
    if (edges > kMostEdges)
      return false;
    const auto side_of = [&](const SmallPolygon& p) {
      Side side;
      side.size = p.size;
      for (std::size_t c = 0; c < static_cast<std::size_t>(p.size); ++c) {
        const glm::vec3 at(p.corner[c] + shift_);
        side.height[c] = o.plane.at(at.x, at.y, at.z);
        for (std::size_t e = 0; e < edges; ++e)
          side.inside[c][e] = o.edge[e].at(at.x, at.y, at.z);
      }
      return side;
    };
    return parts_are_clear(side_of(a), side_of(b), edges, tolerance_);
  });
}

} // namespace daylit::radiosity
