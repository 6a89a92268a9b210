#include "precompute/detail/surface_transport.h"

#include <algorithm>

#include "precompute/detail/factors.h"

namespace daylit::precompute::detail {

/// [patch][channel * clusters + cluster] to one matrix per channel, as the products want it.
SurfaceTransport::SurfaceTransport(const SurfaceLight& light) : light_(light) {
  for (std::size_t c = 0; c < 3; ++c) {
    bounced_[c].resize(light.patches * light.clusters);
    for (std::size_t e = 0; e < light.patches; ++e)
      std::copy_n(light.bounced.data() + (e * 3 + c) * light.clusters, light.clusters,
                  bounced_[c].data() + e * light.clusters);
  }
}

/// b_e = reflectance_e E_e + sum over clusters q of bounced[patch of e, q] * mean of E over q.
std::vector<float> SurfaceTransport::radiosity(int colour, std::span<const float> irradiance,
                                               std::size_t columns) const {
  std::vector<float> mean(light_.clusters * columns, 0.0f);
  for (std::size_t s = 0; s < sources(); ++s)
    for (std::size_t k = 0; k < columns; ++k)
      mean[light_.cluster[s] * columns + k] += light_.cluster_fraction[s] * irradiance[s * columns + k];
  const std::vector<float> further =
      multiply(bounced_[static_cast<std::size_t>(colour)], mean, light_.patches, light_.clusters, columns);
  std::vector<float> b(elements() * columns);
  for (std::size_t element = 0; element < elements(); ++element)
    std::copy_n(further.data() + light_.parent[element] * columns, columns, b.data() + element * columns);
  for (std::size_t s = 0; s < sources(); ++s)
    for (std::size_t k = 0; k < columns; ++k)
      b[light_.source[s] * columns + k] += light_.reflectance[s][colour] * irradiance[s * columns + k];
  return b;
}

namespace {

/// Patches, increasing, that a cluster of probes sees anything of: few, where a room is part of a building.
std::vector<std::uint32_t> weighted_patches(std::span<const float> weights, const SeenParts& seen) {
  const std::size_t parts = seen.part.size();
  std::vector<std::uint8_t> weighted(parts, 0);
  for (auto row = weights.begin(); row != weights.end(); row += std::ptrdiff_t(parts))
    for (std::size_t k = 0; k < parts; ++k)
      if (row[std::ptrdiff_t(k)] != 0.0f)
        weighted[k] = 1;
  std::vector<std::uint32_t> patches;
  for (std::size_t k = 0; k < parts; ++k)
    if (weighted[k] != 0 && (patches.empty() || patches.back() != seen.part[k].patch))
      patches.push_back(seen.part[k].patch);
  return patches;
}

/// Weights [row][part] summed to [row][patch].
std::vector<float> on_patches(std::span<const float> weights, std::size_t rows, const SeenParts& seen,
                              std::span<const std::uint32_t> patches) {
  const std::size_t parts = seen.part.size();
  std::vector<float> sums(rows * patches.size(), 0.0f);
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t k = 0, i = 0; k < parts && i < patches.size(); ++k) {
      if (seen.part[k].patch > patches[i] && ++i == patches.size())
        break;
      if (seen.part[k].patch == patches[i])
        sums[r * patches.size() + i] += weights[r * parts + k];
    }
  return sums;
}

} // namespace

/// w_E[a] = reflectance_a w_b[a] + cluster_fraction_a sum over parts k of w_b[k] bounced[patch of k, cluster of a]: the
/// transpose of radiosity(), summed over the parts.
void SurfaceTransport::add_adjoint(int colour, std::span<const float> weights, std::size_t rows, const SeenParts& seen,
                                   std::span<float> result) const {
  const std::size_t parts = seen.part.size(), lit = seen.lit.size();
  const std::vector<std::uint32_t> patches = weighted_patches(weights, seen);
  const std::vector<float> of_patches = on_patches(weights, rows, seen, patches);
  std::vector<float> bounced(patches.size() * light_.clusters);
  for (std::size_t i = 0; i < patches.size(); ++i)
    std::copy_n(bounced_[static_cast<std::size_t>(colour)].data() + patches[i] * light_.clusters, light_.clusters,
                bounced.data() + i * light_.clusters);
  const std::vector<float> by_cluster = multiply(of_patches, bounced, rows, patches.size(), light_.clusters);
  for (std::size_t r = 0; r < rows; ++r) {
    const float *own = weights.data() + r * parts, *further = by_cluster.data() + r * light_.clusters;
    float* to = result.data() + r * lit;
    for (std::size_t a = 0; a < lit; ++a) {
      const SeenParts::Lit& l = seen.lit[a];
      to[a] += l.reflectance[colour] * own[l.part] + l.cluster_fraction * further[l.cluster];
    }
  }
}

} // namespace daylit::precompute::detail
