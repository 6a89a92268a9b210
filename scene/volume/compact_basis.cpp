#include "scene/volume/compact_basis.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/core/parallel.h"
#include "scene/volume/row_kernels.h"

namespace daylit {

namespace {

using Cluster = CompactFactors::Cluster;

constexpr std::size_t kPerProbe = 27; ///< numbers: nine coefficients of three channels

/// Irradiance of the sources, then of the aggregated ones: irradiance[S + g] = sum_s aggregate_weight[s] irradiance[s].
std::vector<Rgb> light_on_sources(const CompactBasis& basis, std::span<const Rgb> region_radiance) {
  std::vector<Rgb> light = irradiance_of_sources(basis.light, region_radiance);
  light.reserve(light.size() + basis.aggregate.size());
  for (const CompactBasis::Aggregate& g : basis.aggregate) {
    Rgb sum(0.0f);
    for (std::size_t s = g.first; s < g.end; ++s)
      sum += basis.aggregate_weight[s] * light[s];
    light.push_back(sum);
  }
  return light;
}

/// sum[probe, lm, c] += sum_k probe_factor[k, probe, lm, c] scale[k] sum_i source_factor[k, i] light[c, i].
template <class T>
void add_components(const Components<T>& components, const ClusterOffsets::Part& at, std::size_t rank,
                    const Cluster& cluster, const float* light, float* sum) {
  std::vector<Rgb> amplitude(rank);
  detail::multiply_rows(components.source_factor.data() + at.source_factor, cluster.sources, light, amplitude);
  const std::size_t count = kPerProbe * cluster.probes;
  std::vector<detail::WeightedRow<T>> rows(rank);
  for (std::size_t k = 0; k < rank; ++k)
    rows[k] = {components.probe_factor.data() + at.probe_factor + k * count,
               components.scale[at.component + k] * amplitude[k]};
  detail::add_rows(rows, count, sum);
}

/// field[probe] of one cluster: its strong and its weak components, in units of radiance.
void combine_cluster(const CompactFactors& factors, const ClusterOffsets& at, const Cluster& cluster,
                     std::span<const Rgb> light, std::span<std::array<Rgb, 9>> result) {
  std::vector<float> of_cluster(3 * std::size_t{cluster.sources}); // [channel, source]
  for (std::size_t i = 0; i < cluster.sources; ++i)
    for (std::size_t c = 0; c < 3; ++c)
      of_cluster[c * cluster.sources + i] = light[factors.source[at.source + i]][static_cast<int>(c)];
  std::vector<std::array<Rgb, 9>> sum(cluster.probes, std::array<Rgb, 9>{});
  if (sum.empty())
    return;
  add_components(factors.strong, at.strong, cluster.strong, cluster, of_cluster.data(), &sum[0][0].r);
  add_components(factors.weak, at.weak, cluster.weak, cluster, of_cluster.data(), &sum[0][0].r);
  for (std::size_t p = 0; p < cluster.probes; ++p)
    result[factors.probe[at.probe + p]] = sum[p];
}

void combine_clusters(const CompactFactors& factors, std::span<const Rgb> light, std::span<std::array<Rgb, 9>> result) {
  const std::vector<ClusterOffsets> at = cluster_offsets(factors);
  parallel_for(std::size_t{0}, factors.cluster.size(),
               [&](std::size_t b) { combine_cluster(factors, at[b], factors.cluster[b], light, result); });
}

Error broken(const char* what) {
  return {ErrorCode::file_malformed, what, "compact basis", "bake it again with daylit-precompute"};
}

} // namespace

std::size_t CompactFactors::bytes() const {
  return sizeof(Cluster) * cluster.size() + sizeof(std::uint32_t) * (probe.size() + source.size()) + strong.bytes() +
         weak.bytes();
}

std::size_t CompactBasis::bytes() const {
  return light.bytes() + sizeof(Aggregate) * aggregate.size() +
         sizeof(float) * (aggregate_weight.size() + light_unit.size()) + nine.bytes() + band4.bytes();
}

/// A cluster with k components takes k sources numbers of the one factor and 27 k probes of the other.
std::vector<ClusterOffsets> cluster_offsets(const CompactFactors& factors) {
  std::vector<ClusterOffsets> at(factors.cluster.size() + 1);
  for (std::size_t b = 0; b < factors.cluster.size(); ++b) {
    const Cluster& c = factors.cluster[b];
    const auto after = [&](const ClusterOffsets::Part& part, std::size_t rank) {
      return ClusterOffsets::Part{part.component + rank, part.source_factor + rank * c.sources,
                                  part.probe_factor + rank * kPerProbe * c.probes};
    };
    at[b + 1] = {at[b].probe + c.probes, at[b].source + c.sources, after(at[b].strong, c.strong),
                 after(at[b].weak, c.weak)};
  }
  return at;
}

void combine(const CompactBasis& basis, std::span<const Rgb> region_radiance, std::span<Sh9Rgb> result,
             std::span<Band4Rgb> band4) {
  const std::vector<Rgb> light = light_on_sources(basis, region_radiance);
  combine_clusters(basis.nine, light, result);
  if (!band4.empty())
    combine_clusters(basis.band4, light, band4);
}

namespace {

bool all_finite(const std::vector<float>& list) {
  return std::ranges::all_of(list, [](float x) { return std::isfinite(x); });
}

/// Sizes of all arrays against those that the clusters ask for. Sums of products of 32-bit numbers: double is exact
/// enough to refuse what does not fit, and does not overflow.
bool sizes_agree(const CompactFactors& factors) {
  std::array<double, 8> asked{};
  for (const Cluster& c : factors.cluster) {
    const double probes = c.probes, sources = c.sources, strong = c.strong, weak = c.weak;
    const std::array<double, 8> part{probes,
                                     sources,
                                     strong,
                                     weak,
                                     strong * sources,
                                     weak * sources,
                                     double(kPerProbe) * strong * probes,
                                     double(kPerProbe) * weak * probes};
    for (std::size_t k = 0; k < part.size(); ++k)
      asked[k] += part[k];
  }
  const std::array<std::size_t, 8> given{factors.probe.size(),
                                         factors.source.size(),
                                         factors.strong.scale.size(),
                                         factors.weak.scale.size(),
                                         factors.strong.source_factor.size(),
                                         factors.weak.source_factor.size(),
                                         factors.strong.probe_factor.size(),
                                         factors.weak.probe_factor.size()};
  return std::ranges::equal(asked, given, [](double a, std::size_t b) { return a == static_cast<double>(b); });
}

/// Every probe at most once, so that clusters can be combined in any order and at the same time; sources exist.
Result<void> check_factors(const CompactBasis& basis, const CompactFactors& factors, std::size_t probes) {
  std::vector<std::uint8_t> seen(probes, 0);
  for (const std::uint32_t p : factors.probe) {
    if (p >= probes || seen[p] != 0)
      return broken("a cluster names a probe that does not exist, or one twice");
    seen[p] = 1;
  }
  if (!sizes_agree(factors))
    return broken("the factors do not match the clusters");
  const std::size_t sources = basis.sources() + basis.aggregate.size();
  if (std::ranges::any_of(factors.source, [&](std::uint32_t s) { return s >= sources; }))
    return broken("a cluster names a source that does not exist");
  if (!all_finite(factors.strong.scale) || !all_finite(factors.weak.scale))
    return broken("the scale of a component is not finite");
  return {};
}

/// Aggregated sources are disjoint runs: each source has one weight.
Result<void> check_aggregates(const CompactBasis& basis) {
  std::uint32_t end = 0;
  for (const CompactBasis::Aggregate& g : basis.aggregate) {
    if (g.first < end || g.end < g.first || g.end > basis.sources())
      return broken("aggregated sources overlap, or name sources that do not exist");
    end = g.end;
  }
  if (!basis.light_unit.empty() && (basis.light_unit.size() != basis.sources() || !all_finite(basis.light_unit)))
    return broken("the units of the sources are not finite, or not those of the sources");
  if (basis.aggregate_weight.size() != basis.sources() || !all_finite(basis.aggregate_weight))
    return broken("the weights of aggregated sources are not finite, or not those of the sources");
  return {};
}

} // namespace

Result<void> check_compact(const CompactBasis& basis, int regions, std::size_t probes) {
  if (const Result<void> good = check_first_light(basis.light, regions); !good)
    return good;
  if (const Result<void> good = check_aggregates(basis); !good)
    return good;
  if (const Result<void> good = check_factors(basis, basis.nine, probes); !good)
    return good;
  return check_factors(basis, basis.band4, probes);
}

} // namespace daylit
