#include "precompute/detail/linear_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/mat2x2.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>

#include "scene/core/orthonormal.h"
#include "scene/core/parallel.h"

namespace daylit::precompute::detail {

namespace {

using radiosity::Patch;
using Share = LinearLight::Share;

constexpr double kSame = 1e-5;   // units: corners that count as one
constexpr double kAround = 0.02; // det M / (tr M)^2, at most 1/4: below, the neighbours lie in one line
constexpr double kAbove = 1e-2;  // of the way, off the surface: where it is looked for what stands between two patches

/// Patches that share a corner, increasing.
class Corners {
public:
  explicit Corners(std::span<const Patch> patches) {
    for (std::uint32_t p = 0; p < patches.size(); ++p)
      for (const glm::dvec3& c : patches[p].corner)
        at_[key(c)].push_back(p);
  }
  std::vector<std::uint32_t> around(const Patch& patch) const {
    std::vector<std::uint32_t> list;
    for (const glm::dvec3& c : patch.corner)
      list.insert(list.end(), at_.at(key(c)).begin(), at_.at(key(c)).end());
    std::ranges::sort(list);
    const auto repeated = std::ranges::unique(list);
    list.erase(repeated.begin(), repeated.end());
    return list;
  }

private:
  using Key = std::array<std::int64_t, 3>;
  static Key key(const glm::dvec3& c) {
    return {std::llround(c.x / kSame), std::llround(c.y / kSame), std::llround(c.z / kSame)};
  }
  std::map<Key, std::vector<std::uint32_t>> at_;
};

/// Slope of the light at a patch: the sum over its neighbours k of `to[k]` (f_k - f), per metre along u and v.
struct Slope {
  std::vector<std::uint32_t> neighbour;
  std::vector<glm::dvec2> to;
};

/// to_k = M^-1 w_k d_k with M = sum of w_k d_k d_k^T, d: way between the middles, w = 1 / d^2.
Slope slope_of(std::span<const glm::dvec2> way, std::vector<std::uint32_t> neighbour) {
  glm::dmat2 m(0.0);
  for (const glm::dvec2& d : way)
    m += glm::outerProduct(d, d) / glm::dot(d, d);
  const double trace = m[0][0] + m[1][1];
  if (!(glm::determinant(m) > kAround * trace * trace))
    return {};
  Slope slope{std::move(neighbour), {}};
  const glm::dmat2 inverse = glm::inverse(m);
  for (const glm::dvec2& d : way)
    slope.to.push_back(inverse * d / glm::dot(d, d));
  return slope;
}

/// Patches of one surface, and the axes of each.
class Neighbourhood {
public:
  Neighbourhood(const radiosity::SurfaceMesh& mesh, std::span<const Patch> patches, const RayScene& room)
      : mesh_(mesh), patches_(patches), room_(room), corners_(patches) {}

  Slope slope(std::uint32_t p) const {
    std::vector<std::uint32_t> neighbour;
    std::vector<glm::dvec2> way;
    for (const std::uint32_t q : corners_.around(patches_[p]))
      if (q != p && meet(patches_[p], patches_[q])) {
        neighbour.push_back(q);
        way.push_back(way_to(p, patches_[q].middle()));
      }
    return slope_of(way, std::move(neighbour));
  }
  /// From the middle of a patch, along its axes.
  glm::dvec2 way_to(std::uint32_t p, const glm::dvec3& x) const {
    const OrthonormalBasis axes(patches_[p].normal);
    const glm::dvec3 way = x - patches_[p].middle();
    return {glm::dot(way, axes.u), glm::dot(way, axes.v)};
  }

private:
  bool meet(const Patch& a, const Patch& b) const {
    if (mesh_.facets[a.facet].plane != mesh_.facets[b.facet].plane || glm::dot(a.normal, b.normal) <= 0.0)
      return false;
    const glm::dvec3 way = b.middle() - a.middle(), from = a.middle() + kAbove * glm::length(way) * a.normal;
    return !room_.occluded(room_.to_local(mesh_.origin + from), glm::vec3(way), 0.0f, 1.0f);
  }

  const radiosity::SurfaceMesh& mesh_;
  std::span<const Patch> patches_;
  const RayScene& room_;
  Corners corners_;
};

} // namespace

/// f(x) = f_p + slope . (x - x_p)
LinearLight::LinearLight(const radiosity::SurfaceMesh& mesh, std::span<const Patch> patches,
                         std::span<const Patch> elements, std::span<const std::uint32_t> parent, const RayScene& room) {
  std::vector<std::uint32_t> count(patches.size(), 0); // of elements
  for (const std::uint32_t p : parent)
    ++count[p];
  const Neighbourhood around(mesh, patches, room);
  std::vector<Slope> slopes(patches.size());
  parallel_for(std::size_t{0}, patches.size(), [&](std::size_t p) {
    if (count[p] > 1) // one alone is its patch
      slopes[p] = around.slope(static_cast<std::uint32_t>(p));
  });
  begin_.push_back(0);
  for (std::size_t e = 0; e < elements.size(); ++e) {
    const Slope& slope = slopes[parent[e]];
    const glm::dvec2 at = around.way_to(parent[e], elements[e].middle());
    double own = 1.0;
    for (std::size_t k = 0; k < slope.to.size(); ++k) {
      const double weight = glm::dot(at, slope.to[k]);
      own -= weight;
      share_.push_back({slope.neighbour[k], static_cast<float>(weight)});
    }
    share_.push_back({parent[e], static_cast<float>(own)});
    begin_.push_back(share_.size());
  }
}

} // namespace daylit::precompute::detail
