#pragma once

// The slow twin of a compact basis: its formulas number by number, as docs/volume-format.md defines them.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/volume/compact_basis.h"

namespace daylit::test {

/// irradiance[s, c] by the weights of the sparse rows.
inline std::vector<glm::dvec3> plain_irradiance(const FirstLight& light, std::span<const Rgb> radiance) {
  std::vector<glm::dvec3> irradiance(light.sources(), glm::dvec3(0.0));
  for (std::size_t s = 0; s < irradiance.size(); ++s)
    for (int c = 0; c < 3; ++c)
      for_each_weight(
          light, (light.colours == 3 ? static_cast<std::size_t>(c) * light.sources() : 0) + s,
          [&](std::size_t node, float weight) { irradiance[s][c] += double(weight) * double(radiance[node][c]); });
  return irradiance;
}

/// field[probe] += sum_k probe_factor scale sum_i source_factor light[source].
template <class T>
void add_plain_components(const CompactFactors& f, const CompactFactors::Cluster& cluster, const ClusterOffsets& at,
                          const Components<T>& components, const ClusterOffsets::Part& part, std::size_t rank,
                          std::span<const glm::dvec3> light, std::vector<std::array<glm::dvec3, 9>>& field) {
  for (std::size_t k = 0; k < rank; ++k) {
    glm::dvec3 amplitude(0.0);
    for (std::size_t i = 0; i < cluster.sources; ++i)
      amplitude += double(components.source_factor[part.source_factor + k * cluster.sources + i]) *
                   light[f.source[at.source + i]];
    amplitude *= double(components.scale[part.component + k]);
    for (std::size_t p = 0; p < cluster.probes; ++p)
      for (std::size_t lm = 0; lm < 9; ++lm)
        for (std::size_t c = 0; c < 3; ++c)
          field[f.probe[at.probe + p]][lm][int(c)] +=
              double(components.probe_factor[part.probe_factor + ((k * cluster.probes + p) * 9 + lm) * 3 + c]) *
              amplitude[int(c)];
  }
}

inline std::vector<std::array<Rgb, 9>> plain_field(const CompactBasis& basis, const CompactFactors& f,
                                                   std::span<const Rgb> radiance, std::size_t probes) {
  std::vector<glm::dvec3> light = plain_irradiance(basis.light, radiance);
  for (const CompactBasis::Aggregate& g : basis.aggregate) {
    glm::dvec3 sum(0.0);
    for (std::uint32_t s = g.first; s < g.end; ++s)
      sum += double(basis.aggregate_weight[s]) * light[s];
    light.push_back(sum);
  }
  std::vector<std::array<glm::dvec3, 9>> field(probes);
  const std::vector<ClusterOffsets> at = cluster_offsets(f);
  for (std::size_t b = 0; b < f.cluster.size(); ++b) {
    const CompactFactors::Cluster& cluster = f.cluster[b];
    add_plain_components(f, cluster, at[b], f.strong, at[b].strong, cluster.strong, light, field);
    add_plain_components(f, cluster, at[b], f.weak, at[b].weak, cluster.weak, light, field);
  }
  std::vector<std::array<Rgb, 9>> out(probes);
  for (std::size_t p = 0; p < probes; ++p)
    std::ranges::transform(field[p], out[p].begin(), [](const glm::dvec3& x) { return Rgb(x); });
  return out;
}

} // namespace daylit::test
