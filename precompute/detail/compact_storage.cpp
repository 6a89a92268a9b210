#include "precompute/detail/compact_storage.h"

#include <algorithm>

#include "scene/core/parallel.h"

namespace daylit::precompute::detail {

namespace {

constexpr std::size_t kRoundingSuns = 64;
constexpr double kCertain = 0.3;         ///< of the allowed squared error: what is surely too weak to keep, in all
constexpr double kStorageFraction = 0.2; ///< of it, that choosing the storage may always spend

/// Leaves the strongest components of all clusters together; the squared error of the others, at most `allowed`.
double drop_weakest(std::vector<ProbeCluster>& clusters, double allowed) {
  std::vector<double> power;
  for (const ProbeCluster& c : clusters)
    power.insert(power.end(), c.factors.power.begin(), c.factors.power.end());
  std::ranges::sort(power);
  double dropped = 0, limit = -1; // summed from the small ones, never as a difference of large numbers
  for (const double p : power) {
    if (dropped + p > allowed)
      break;
    dropped += p;
    limit = p;
  }
  for (ProbeCluster& c : clusters)
    c.factors.keep(
        static_cast<std::size_t>(std::ranges::count_if(c.factors.power, [&](double p) { return p > limit; })));
  return dropped;
}

} // namespace

/// Allowed squared error = what dropping surely may take + what clusters leave unseen + what the storage takes.
void choose_storage(std::vector<ProbeCluster>& clusters, const Measure& measure, double allowed) {
  const std::vector<float> on_sources = measure.suns(kRoundingSuns);
  const auto suns = [&](const ProbeCluster& c) {
    return c.seen.suns(c.own, measure.metric, on_sources, kRoundingSuns);
  };
  const double own = kStorageFraction * allowed;
  allowed -= drop_weakest(clusters, kCertain * allowed);
  parallel_for(std::size_t{0}, clusters.size(), [&](std::size_t b) { clusters[b].expand(); });
  std::vector<std::vector<double>> weak_error2(clusters.size());
  parallel_for(std::size_t{0}, clusters.size(), [&](std::size_t b) {
    weak_error2[b] = clusters[b].factors.weak_error2(suns(clusters[b]), kRoundingSuns);
  });
  std::vector<Component> list;
  for (std::size_t b = 0; b < clusters.size(); ++b) {
    const Factors& f = clusters[b].factors;
    allowed -= clusters[b].unseen;
    for (std::size_t k = 0; k < f.rank(); ++k)
      list.push_back({f.power[k], weak_error2[b][k], f.sources + f.rows});
  }
  double per_byte = 0;
  const std::vector<Stored> choice = cheapest(list, std::max(allowed, own), &per_byte);
  auto next = choice.begin();
  for (ProbeCluster& c : clusters) {
    const auto end = next + std::ptrdiff_t(c.factors.rank());
    c.factors.store_as({next, end});
    next = end;
  }
  parallel_for(std::size_t{0}, clusters.size(),
               [&](std::size_t b) { clusters[b].band4.choose_storage(per_byte, suns(clusters[b]), kRoundingSuns); });
}

namespace {

/// The sources that clusters see as one: the same runs for all clusters, patch by patch.
class Aggregates {
public:
  Aggregates(const std::vector<ProbeCluster>& clusters, const std::vector<float>& sigma, CompactBasis& basis)
      : aggregate_of_(sigma.size(), 0), sources_(static_cast<std::uint32_t>(sigma.size())) {
    std::vector<std::uint32_t> end(sigma.size(), 0); // of the run that begins with a source
    basis.aggregate_weight.assign(sigma.size(), 0.0f);
    for (const ProbeCluster& c : clusters)
      for (std::size_t a = 0; a < c.seen.lit.size(); ++a)
        if (const SeenParts::Lit& lit = c.seen.lit[a]; lit.is_aggregated()) {
          end[lit.first] = lit.end;
          for (std::uint32_t s = lit.first; s < lit.end; ++s)
            basis.aggregate_weight[s] = c.seen.fraction[s] * sigma[s] / c.own.sigma[a];
        }
    for (std::uint32_t s = 0; s < end.size(); ++s)
      if (end[s] != 0) {
        aggregate_of_[s] = static_cast<std::uint32_t>(basis.aggregate.size());
        basis.aggregate.push_back({s, end[s]});
      }
  }

  void add_sources(const SeenParts& seen, std::vector<std::uint32_t>& source) const {
    for (const SeenParts::Lit& lit : seen.lit)
      source.push_back(lit.is_aggregated() ? sources_ + aggregate_of_[lit.first] : lit.first);
  }

private:
  std::vector<std::uint32_t> aggregate_of_; ///< by its first source
  std::uint32_t sources_;
};

} // namespace

/// Per cluster: probes, sources (numbered from 0, runs of them after the last) and both factors.
CompactBasis assemble(const std::vector<ProbeCluster>& clusters, const SurfaceLight& light,
                      const std::vector<float>& sigma, std::span<const std::size_t> probe_of_point) {
  CompactBasis basis;
  basis.light = store_first_light(light, sigma);
  basis.light_unit = sigma;
  const Aggregates aggregates(clusters, sigma, basis);
  const auto add = [&](const ProbeCluster& c, const Factors& factors, CompactFactors& out) {
    out.cluster.push_back({.probes = static_cast<std::uint32_t>(c.point.size())});
    if (factors.rank() > 0) // no light reaches the others
      aggregates.add_sources(c.seen, out.source);
    for (const std::uint32_t p : c.point)
      out.probe.push_back(static_cast<std::uint32_t>(probe_of_point[p]));
    append_factors(factors, out);
  };
  for (const ProbeCluster& c : clusters) {
    add(c, c.factors, basis.nine);
    if (c.band4.factors.rank() > 0)
      add(c, c.band4.factors, basis.band4);
  }
  return basis;
}

} // namespace daylit::precompute::detail
