#include "precompute/detail/light_leaves.h"

#include <algorithm>
#include <queue>

#include <glm/geometric.hpp>
#include <tbb/parallel_for.h>

namespace daylit::precompute::detail {

namespace {

using radiosity::Patch;

std::array<Patch, 2> halves(const Patch& p) {
  int longest = 0;
  for (int k = 1; k < 3; ++k)
    if (glm::distance(p.corner[k], p.corner[(k + 1) % 3]) >
        glm::distance(p.corner[longest], p.corner[(longest + 1) % 3]))
      longest = k;
  const int next = (longest + 1) % 3;
  // The same point from either side of the edge: neighbours that are cut both stay without a gap.
  const glm::dvec3 middle = 0.5 * (p.corner[longest] + p.corner[next]);
  std::array<Patch, 2> half{p, p};
  half[0].corner[next] = middle;
  half[1].corner[longest] = middle;
  half[0].area_m2 = half[1].area_m2 = 0.5 * p.area_m2;
  return half;
}

constexpr double kGrazing = 0.25;

/// How bright a sun can be on the patch: 0 where no part of an aperture stands higher than its lowest corner, more
/// where it faces one.
double sun_share(const Patch& p, const radiosity::PatchMesh& mesh, const std::vector<Aperture>& apertures) {
  const glm::dvec3 middle = (p.corner[0] + p.corner[1] + p.corner[2]) / 3.0;
  const double lowest_m = std::min({p.corner[0].z, p.corner[1].z, p.corner[2].z});
  double share = 0;
  for (const Aperture& a : apertures) {
    glm::dvec3 centre(0.0);
    double highest_m = lowest_m;
    for (const glm::dvec3& c : a.corners) {
      centre += (c - mesh.origin) / static_cast<double>(a.corners.size());
      highest_m = std::max(highest_m, c.z - mesh.origin.z);
    }
    const glm::dvec3 way = centre - middle;
    if (highest_m > lowest_m)
      share = std::max(share, kGrazing + std::abs(glm::dot(p.normal, way)) / std::max(glm::length(way), 1e-9));
  }
  return share;
}

/// How often each patch is halved.
std::vector<int> find_cuts(const radiosity::PatchMesh& mesh, const radiosity::ElementSet& elements,
                           const std::vector<Aperture>& apertures, std::size_t count) {
  struct Piece {
    double size;
    std::uint32_t patch;
    bool operator<(const Piece& o) const { return size != o.size ? size < o.size : patch > o.patch; }
  };
  std::priority_queue<Piece> queue;
  for (std::uint32_t p = 0; p < mesh.patches.size(); ++p)
    if (const auto& sides = elements.of_patch[p]; sides[0] >= 0 || sides[1] >= 0)
      if (const double share = sun_share(mesh.patches[p], mesh, apertures); share > 0)
        queue.push({share * mesh.patches[p].area_m2, p});
  std::vector<int> cuts(mesh.patches.size(), 0);
  // All pieces of a patch are cut together.
  for (std::size_t have = mesh.patches.size(); have < count && !queue.empty();) {
    const Piece next = queue.top();
    queue.pop();
    have += std::size_t{1} << cuts[next.patch];
    ++cuts[next.patch];
    queue.push({0.5 * next.size, next.patch});
  }
  return cuts;
}

void append(const Patch& p, int cuts, std::vector<Patch>& out) {
  if (cuts == 0) {
    out.push_back(p);
    return;
  }
  for (const Patch& half : halves(p))
    append(half, cuts - 1, out);
}

} // namespace

Result<LightLeaves> LightLeaves::make(const radiosity::PatchMesh& mesh, const radiosity::ElementSet& elements,
                                      const std::vector<Aperture>& apertures, std::size_t count) {
  const std::vector<int> cuts = find_cuts(mesh, elements, apertures, count);
  LightLeaves leaves;
  leaves.mesh.origin = mesh.origin;
  leaves.mesh.planes = mesh.planes;
  leaves.mesh.edge_m = mesh.edge_m;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order; // element, number of its leaf
  for (std::uint32_t p = 0; p < mesh.patches.size(); ++p) {
    const std::size_t first = leaves.mesh.patches.size();
    append(mesh.patches[p], cuts[p], leaves.mesh.patches);
    leaves.elements.of_patch.resize(leaves.mesh.patches.size(), {-1, -1});
    for (int side = 0; side < 2; ++side) {
      const std::int32_t parent = elements.of_patch[p][side];
      for (std::size_t i = first; parent >= 0 && i < leaves.mesh.patches.size(); ++i) {
        const Patch& leaf = leaves.mesh.patches[i];
        radiosity::Element e = elements.elements[static_cast<std::size_t>(parent)];
        e.area_m2 = leaf.area_m2;
        e.patch = static_cast<std::uint32_t>(i);
        e.corner = leaf.corner;
        if (side == 1)
          std::swap(e.corner[1], e.corner[2]);
        leaves.elements.of_patch[i][side] = static_cast<std::int32_t>(leaves.elements.elements.size());
        leaves.share.push_back(
            static_cast<float>(e.area_m2 / elements.elements[static_cast<std::size_t>(parent)].area_m2));
        leaves.elements.elements.push_back(e);
        leaves.parent.push_back(static_cast<std::uint32_t>(parent));
      }
    }
  }
  auto rays = radiosity::patch_scene(leaves.mesh);
  if (!rays)
    return rays.error();
  leaves.rays = std::move(*rays);
  return leaves;
}

std::vector<float> LightLeaves::opening_of_parents(const std::vector<radiosity::FirstBounceRow>& rows) const {
  std::vector<float> opening(parent.empty() ? 0 : parent.back() + 1, 0.0f);
  for (std::size_t i = 0; i < parent.size(); ++i)
    opening[parent[i]] += share[i] * rows[i].opening;
  return opening;
}

radiosity::FirstBounce LightLeaves::of_parents(const radiosity::FirstBounce& light) const {
  radiosity::FirstBounce mean{.elements = parent.empty() ? 0 : parent.back() + std::size_t{1},
                              .channels = light.channels,
                              .region = light.region,
                              .irradiance = {},
                              .opening = {}};
  mean.irradiance.assign(mean.elements * static_cast<std::size_t>(light.channels) * light.columns(), 0.0f);
  mean.opening.assign(mean.elements, 0.0f);
  for (std::size_t i = 0; i < parent.size(); ++i) {
    mean.opening[parent[i]] += share[i] * light.opening[i];
    for (int c = 0; c < light.channels; ++c)
      for (std::size_t k = 0; k < light.columns(); ++k)
        mean.row(parent[i], c)[k] += share[i] * light.row(i, c)[k];
  }
  return mean;
}

radiosity::Radiosity LightLeaves::radiosity_of(const radiosity::Radiosity& parents,
                                               const radiosity::FirstBounce& parent_light,
                                               const radiosity::FirstBounce& light) const {
  const std::size_t columns = light.columns();
  radiosity::Radiosity out{.elements = parent.size(),
                           .columns = parents.columns,
                           .b = std::vector<float>(parent.size() * parents.columns),
                           .copy_of = parents.copy_of};
  tbb::parallel_for(std::size_t{0}, parent.size(), [&](std::size_t i) {
    for (int c = 0; c < 3; ++c) {
      const float reflectance = elements.elements[i].reflectance[c];
      const float* further =
          parents.row(parent[i]) + static_cast<std::size_t>(parents.copy_of[static_cast<std::size_t>(c)]) * columns;
      float* to = out.b.data() + i * parents.columns + static_cast<std::size_t>(c) * columns;
      for (std::size_t k = 0; k < columns; ++k)
        to[k] = further[k] + reflectance * (light.row(i, c)[k] - parent_light.row(parent[i], c)[k]);
    }
  });
  return out;
}

} // namespace daylit::precompute::detail
