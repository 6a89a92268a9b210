#include "precompute/detail/light_elements.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <queue>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/core/orthonormal.h"
#include "scene/core/parallel.h"
#include "scene/room/pane_outline.h"

namespace daylit::precompute::detail {

namespace {

using radiosity::Facet;

/// Cut through the middle of the longest edge (Rivara's bisection): angles stay bounded.
std::array<Facet, 2> halves(const Facet& p) {
  int longest = 0;
  for (int k = 1; k < 3; ++k)
    if (glm::distance(p.corner[k], p.corner[(k + 1) % 3]) >
        glm::distance(p.corner[longest], p.corner[(longest + 1) % 3]))
      longest = k;
  const int next = (longest + 1) % 3;
  // The same point from either side of the edge: neighbours that are cut both stay without a gap.
  const glm::dvec3 middle = 0.5 * (p.corner[longest] + p.corner[next]);
  std::array<Facet, 2> half{p, p};
  half[0].corner[next] = middle;
  half[1].corner[longest] = middle;
  half[0].area_m2 = half[1].area_m2 = 0.5 * p.area_m2;
  return half;
}

constexpr double kGrazing = 0.25;
constexpr double kInside = 0.9;  // of the way from a middle to a corner: where one looks from and to
constexpr double kHidden = 0.1;  // of what faces an aperture: what it counts if it sees none of the points looked for
constexpr double kBeside = 0.25; // of a pane's width: nearer than that its light changes within the distance from it
constexpr double kNearest = 1.0 / 32.0;
constexpr int kWaysOver = 8;        // a facet to the surfaces beside it,
constexpr double kOver = 0.03;      // of its size above it
constexpr double kFinest = 2.0;     // times shorter than elsewhere are elements beside another surface, at most
constexpr float kWholeWay = 0.999f; // of a ray to an aperture

/// The middle of an outline and a point near each corner.
template <class Corners>
std::vector<glm::dvec3> points_of(const Corners& corners, const glm::dvec3& origin) {
  glm::dvec3 middle(0.0);
  for (const glm::dvec3& c : corners)
    middle += (c - origin) / static_cast<double>(corners.size());
  std::vector<glm::dvec3> points{middle};
  for (const glm::dvec3& c : corners)
    points.push_back(glm::mix(middle, c - origin, kInside));
  return points;
}

/// How bright a sun can be on a patch: 0 where no point of an aperture looked for is higher and before it, or all are
/// seen from outside; more where it faces one that it sees.
class SunExposure {
public:
  SunExposure(const radiosity::SurfaceMesh& mesh, const std::vector<Aperture>& apertures, const RayScene& room)
      : room_(room), to_room_(mesh.origin - room.origin()) {
    for (const Aperture& a : apertures) {
      pane_.emplace_back(a, mesh.origin);
      for (const glm::dvec3& p : points_of(a.corners, mesh.origin))
        target_.push_back({p, a.inward});
    }
  }

  /// What the area of a facet with its middle at p counts more: elements beside a pane are as large as their distance
  /// from it, those elsewhere as large as at a quarter of its width.
  double beside_panes(const glm::dvec3& p) const {
    double more = 1.0;
    for (const PaneOutline& pane : pane_) {
      const double far = kBeside * pane.width_m / std::max(pane.distance(p), kNearest * pane.width_m);
      more = std::max(more, far * far);
    }
    return more;
  }

  /// The same beside another surface, as in a corner, where light falls off within the distance from it: elements are
  /// as large as that.
  double beside_surfaces(const radiosity::Patch& e) const {
    const double size = std::sqrt(2.0 * e.area_m2);
    const OrthonormalBasis basis(e.normal);
    const glm::vec3 from(e.middle() + kOver * size * e.normal + to_room_);
    double nearest = size;
    for (int k = 0; k < kWaysOver; ++k) {
      const double a = 2.0 * std::numbers::pi * k / kWaysOver;
      RayHit hit;
      if (room_.closest(from, glm::vec3(std::cos(a) * basis.u + std::sin(a) * basis.v), 0.0f,
                        static_cast<float>(nearest), hit))
        nearest = static_cast<double>(hit.distance);
    }
    const double finer = std::min(size / std::max(nearest, 1e-9), kFinest);
    return finer * finer;
  }

  double of(const radiosity::Patch& e) const {
    double seen = 0, faced = 0;
    for (const glm::dvec3& from : points_of(e.corner, glm::dvec3(0.0)))
      for (const Target& to : target_) {
        const glm::dvec3 way = to.at - from;
        const double cosine = glm::dot(e.normal, way) / std::max(glm::length(way), 1e-9);
        if (way.z <= 0.0 || cosine <= 0.0 || glm::dot(way, to.inward) > 0.0)
          continue;
        faced = std::max(faced, kGrazing + cosine);
        if (kGrazing + cosine > seen && !blocked(from, way))
          seen = kGrazing + cosine;
      }
    return std::max(seen, kHidden * faced);
  }

private:
  bool blocked(const glm::dvec3& from, const glm::dvec3& way) const {
    const auto offset = static_cast<float>(4.0 * static_cast<double>(room_.surface_offset()) / glm::length(way));
    return room_.occluded(glm::vec3(from + to_room_), glm::vec3(way), offset, kWholeWay);
  }

  struct Target {
    glm::dvec3 at, inward;
  };
  const RayScene& room_;
  glm::dvec3 to_room_;
  std::vector<Target> target_;
  std::vector<PaneOutline> pane_;
};

/// How often each facet is halved: always the facet whose parts have the largest exposure * area, more beside panes and
/// in corners.
std::vector<int> find_cuts(const radiosity::SurfaceMesh& mesh, const radiosity::PatchSet& patches,
                           const SunExposure& exposure, const radiosity::SizeField& field, std::size_t count) {
  struct Part {
    double size;
    std::uint32_t facet;
    bool operator<(const Part& o) const { return size != o.size ? size < o.size : facet > o.facet; }
  };
  std::vector<double> exposed(mesh.facets.size(), 0.0), more(mesh.facets.size(), 1.0);
  parallel_for(std::size_t{0}, exposed.size(), [&](std::size_t p) {
    for (const std::int32_t side : patches.of_facet[p])
      if (side >= 0) {
        const radiosity::Patch& patch = patches.patches[static_cast<std::size_t>(side)];
        exposed[p] = std::max(exposed[p], exposure.of(patch));
        more[p] = std::max({more[p], exposure.beside_panes(patch.middle()), exposure.beside_surfaces(patch)});
      }
  });
  std::priority_queue<Part> queue;
  for (std::uint32_t p = 0; p < mesh.facets.size(); ++p)
    if (exposed[p] > 0) {
      const Facet& f = mesh.facets[p];
      const glm::dvec3 middle = (f.corner[0] + f.corner[1] + f.corner[2]) / 3.0;
      const double larger = field.at(mesh.origin + middle);
      queue.push({exposed[p] * more[p] * f.area_m2 / (larger * larger), p});
    }
  std::vector<int> cuts(mesh.facets.size(), 0);
  // All parts of a facet are cut together.
  for (std::size_t have = mesh.facets.size(); have < count && !queue.empty();) {
    const Part next = queue.top();
    queue.pop();
    have += std::size_t{1} << cuts[next.facet];
    ++cuts[next.facet];
    queue.push({0.5 * next.size, next.facet});
  }
  return cuts;
}

void append(const Facet& p, int cuts, std::vector<Facet>& out) {
  if (cuts == 0) {
    out.push_back(p);
    return;
  }
  for (const Facet& half : halves(p))
    append(half, cuts - 1, out);
}

} // namespace

/// The parts [first, end) of a facet become elements of the patch on one of its sides.
void LightElements::add_side(const radiosity::PatchSet& parents, std::size_t facet, int side, std::size_t first) {
  const std::int32_t id = parents.of_facet[facet][side];
  if (id < 0)
    return;
  const radiosity::Patch& whole = parents.patches[static_cast<std::size_t>(id)];
  for (std::size_t i = first; i < mesh.facets.size(); ++i) {
    radiosity::Patch e = whole;
    e.area_m2 = mesh.facets[i].area_m2;
    e.facet = static_cast<std::uint32_t>(i);
    e.corner = mesh.facets[i].corner;
    if (side == 1)
      std::swap(e.corner[1], e.corner[2]);
    patches.of_facet[i][side] = static_cast<std::int32_t>(patches.patches.size());
    fraction.push_back(static_cast<float>(e.area_m2 / whole.area_m2));
    patches.patches.push_back(e);
    parent.push_back(static_cast<std::uint32_t>(id));
  }
}

Result<LightElements> LightElements::make(const radiosity::SurfaceMesh& mesh, const radiosity::PatchSet& patches,
                                          const std::vector<Aperture>& apertures, const RayScene& room,
                                          const radiosity::SizeField& field, std::size_t count) {
  const std::vector<int> cuts = find_cuts(mesh, patches, SunExposure(mesh, apertures, room), field, count);
  LightElements made;
  made.mesh.origin = mesh.origin;
  made.mesh.planes = mesh.planes;
  made.mesh.edge_m = mesh.edge_m;
  for (std::uint32_t p = 0; p < mesh.facets.size(); ++p) {
    const std::size_t first = made.mesh.facets.size();
    append(mesh.facets[p], cuts[p], made.mesh.facets);
    made.patches.of_facet.resize(made.mesh.facets.size(), {-1, -1});
    for (int side = 0; side < 2; ++side)
      made.add_side(patches, p, side, first);
  }
  auto rays = radiosity::facet_scene(made.mesh);
  if (!rays)
    return rays.error();
  made.rays = std::move(*rays);
  made.further = LinearLight(mesh, patches.patches, made.patches.patches, made.parent, room);
  return made;
}

std::vector<float> LightElements::opening_of_parents(const std::vector<radiosity::FirstBounceRow>& rows) const {
  std::vector<float> opening(parent.empty() ? 0 : parent.back() + 1, 0.0f);
  for (std::size_t i = 0; i < parent.size(); ++i)
    opening[parent[i]] += fraction[i] * rows[i].opening;
  return opening;
}

radiosity::FirstBounce LightElements::of_parents(const radiosity::FirstBounce& light) const {
  radiosity::FirstBounce mean{.patches = parent.empty() ? 0 : parent.back() + std::size_t{1},
                              .channels = light.channels,
                              .region = light.region,
                              .irradiance = {},
                              .opening = {}};
  mean.irradiance.assign(mean.patches * static_cast<std::size_t>(light.channels) * light.columns(), 0.0f);
  mean.opening.assign(mean.patches, 0.0f);
  for (std::size_t i = 0; i < parent.size(); ++i) {
    mean.opening[parent[i]] += fraction[i] * light.opening[i];
    for (int c = 0; c < light.channels; ++c)
      for (std::size_t k = 0; k < light.columns(); ++k)
        mean.row(parent[i], c)[k] += fraction[i] * light.row(i, c)[k];
  }
  return mean;
}

radiosity::Radiosity LightElements::radiosity_of(const radiosity::Radiosity& parents,
                                                 const radiosity::FirstBounce& parent_light,
                                                 const radiosity::FirstBounce& light) const {
  const std::size_t columns = light.columns();
  radiosity::Radiosity out{.patches = parent.size(),
                           .columns = parents.columns,
                           .b = std::vector<float>(parent.size() * parents.columns),
                           .copy_of = parents.copy_of};
  parallel_for(std::size_t{0}, parent.size(), [&](std::size_t i) {
    for (int c = 0; c < 3; ++c) {
      const float reflectance = patches.patches[i].reflectance[c];
      const std::size_t channel = static_cast<std::size_t>(parents.copy_of[static_cast<std::size_t>(c)]) * columns;
      float* to = out.b.data() + i * parents.columns + static_cast<std::size_t>(c) * columns;
      for (std::size_t k = 0; k < columns; ++k)
        to[k] = reflectance * light.row(i, c)[k];
      for (const LinearLight::Share& s : further.of(i)) // of one surface: the patches reflect alike
        for (std::size_t k = 0; k < columns; ++k)
          to[k] += s.weight * (parents.row(s.patch)[channel + k] - reflectance * parent_light.row(s.patch, c)[k]);
    }
  });
  return out;
}

} // namespace daylit::precompute::detail
