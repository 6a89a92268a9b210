#include "precompute/detail/surface_transport.h"

#include <algorithm>

#include <cblas.h>

#include "precompute/detail/factors.h"

namespace daylit::precompute::detail {

namespace {
constexpr std::size_t kBlock = 64; // patches: wide enough for a product
} // namespace

/// [patch][channel * clusters + cluster] to one matrix per channel, as the products want it.
SurfaceTransport::SurfaceTransport(const SurfaceLight& light) : light_(light) {
  for (std::size_t c = 0; c < 3; ++c) {
    bounced_[c].resize(light.patches * light.clusters);
    for (std::size_t e = 0; e < light.patches; ++e)
      std::copy_n(light.bounced.data() + (e * 3 + c) * light.clusters, light.clusters,
                  bounced_[c].data() + e * light.clusters);
  }
  for (std::uint32_t p = 0; p < light.patches; ++p)
    whole_.push_back({p, 1.0f});
}

std::span<const LinearLight::Share> SurfaceTransport::of_element(std::size_t element) const {
  return light_.further.empty() ? std::span(whole_).subspan(light_.parent[element], 1) : light_.further.of(element);
}

/// A part that is more than an element holds whole patches.
std::span<const LinearLight::Share> SurfaceTransport::of_part(const SeenParts::Part& part) const {
  return part.is_element() ? of_element(part.first) : std::span(whole_).subspan(part.patch, 1);
}

/// b_e = reflectance_e E_e + sum over patches p of further_ep, over clusters q of bounced[p, q] * mean of E over q.
std::vector<float> SurfaceTransport::radiosity(int colour, std::span<const float> irradiance,
                                               std::size_t columns) const {
  std::vector<float> mean(light_.clusters * columns, 0.0f);
  for (std::size_t s = 0; s < sources(); ++s)
    for (std::size_t k = 0; k < columns; ++k)
      mean[light_.cluster[s] * columns + k] += light_.cluster_fraction[s] * irradiance[s * columns + k];
  const std::vector<float> further =
      multiply(bounced_[static_cast<std::size_t>(colour)], mean, light_.patches, light_.clusters, columns);
  std::vector<float> b(elements() * columns, 0.0f);
  for (std::size_t element = 0; element < elements(); ++element)
    for (const Share& s : of_element(element))
      for (std::size_t k = 0; k < columns; ++k)
        b[element * columns + k] += s.weight * further[s.patch * columns + k];
  for (std::size_t s = 0; s < sources(); ++s)
    for (std::size_t k = 0; k < columns; ++k)
      b[light_.source[s] * columns + k] += light_.reflectance[s][colour] * irradiance[s * columns + k];
  return b;
}

/// Those whose light a cluster of probes sees anything of, increasing, and their neighbours in blocks of kBlock: few,
/// where a room is part of a building.
std::vector<std::uint32_t> SurfaceTransport::weighted_patches(std::span<const float> weights,
                                                              const SeenParts& seen) const {
  const std::size_t parts = seen.part.size();
  std::vector<std::uint8_t> weighted(parts, 0);
  for (auto row = weights.begin(); row != weights.end(); row += std::ptrdiff_t(parts))
    for (std::size_t k = 0; k < parts; ++k)
      if (row[std::ptrdiff_t(k)] != 0.0f)
        weighted[k] = 1;
  std::vector<std::uint8_t> block(light_.patches / kBlock + 1, 0);
  for (std::size_t k = 0; k < parts; ++k)
    if (weighted[k] != 0)
      for (const Share& s : of_part(seen.part[k]))
        block[s.patch / kBlock] = 1;
  std::vector<std::uint32_t> patches;
  for (std::uint32_t p = 0; p < light_.patches; ++p)
    if (block[p / kBlock] != 0)
      patches.push_back(p);
  return patches;
}

/// Weights [row][part] to [row][patch]. `patches`: weighted_patches().
std::vector<float> SurfaceTransport::on_patches(std::span<const float> weights, std::size_t rows, const SeenParts& seen,
                                                std::span<const std::uint32_t> patches) const {
  const std::size_t parts = seen.part.size();
  std::vector<std::uint32_t> number(light_.patches, 0);
  for (std::uint32_t i = 0; i < patches.size(); ++i)
    number[patches[i]] = i;
  std::vector<float> sums(rows * patches.size(), 0.0f);
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t k = 0; k < parts; ++k)
      if (const float weight = weights[r * parts + k]; weight != 0.0f)
        for (const Share& s : of_part(seen.part[k]))
          sums[r * patches.size() + number[s.patch]] += s.weight * weight;
  return sums;
}

/// [row][cluster] = sum over patches of weights[row][patch] bounced[patch][cluster], for runs of patches that follow
/// each other: copies of their rows would take longer than the products.
std::vector<float> SurfaceTransport::times_bounced(int colour, std::span<const float> weights, std::size_t rows,
                                                   std::span<const std::uint32_t> patches) const {
  const std::size_t columns = light_.clusters;
  std::vector<float> sum(rows * columns, 0.0f);
  for (std::size_t first = 0, end = 0; first < patches.size() && !sum.empty(); first = end) {
    for (end = first + 1; end < patches.size() && patches[end] == patches[end - 1] + 1; ++end)
      ;
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, static_cast<int>(rows), static_cast<int>(columns),
                static_cast<int>(end - first), 1.0f, weights.data() + first, static_cast<int>(patches.size()),
                bounced_[static_cast<std::size_t>(colour)].data() + patches[first] * columns, static_cast<int>(columns),
                1.0f, sum.data(), static_cast<int>(columns));
  }
  return sum;
}

/// w_E[a] = reflectance_a w_b[a] + cluster_fraction_a sum over parts k of w_b[k], over patches p of further_kp
/// bounced[p, cluster of a]: the transpose of radiosity(), summed over the parts.
void SurfaceTransport::add_adjoint(int colour, std::span<const float> weights, std::size_t rows, const SeenParts& seen,
                                   std::span<float> result) const {
  const std::size_t parts = seen.part.size(), lit = seen.lit.size();
  const std::vector<std::uint32_t> patches = weighted_patches(weights, seen);
  const std::vector<float> of_patches = on_patches(weights, rows, seen, patches);
  const std::vector<float> by_cluster = times_bounced(colour, of_patches, rows, patches);
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
