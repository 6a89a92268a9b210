#include "precompute/compact_sky.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <vector>

#include <cblas.h>
#include <glm/vec3.hpp>

#include "precompute/detail/compact_storage.h"
#include "precompute/detail/neighbours.h"
#include "precompute/detail/probe_cluster.h"
#include "precompute/detail/sun_metric.h"
#include "scene/core/parallel.h"

namespace daylit::precompute {

namespace {

using detail::kProjections;
using detail::ProbeCluster;

constexpr double kSketchAtThree = 140; ///< columns of the range finder at an error of 3 %, ~ error^-0.8
constexpr double kRangeAtThree = 180;  ///< the same of what counts at all in the rows of a cluster
constexpr std::size_t kSamples = 2, kFewestSamples = 512; ///< suns of the metric: per column of the sketch, at least
constexpr float kBelowHorizon =
    0.2f;                       ///< no sun is there: light from there is smooth, and may err more under a small one
constexpr double kFloor = 0.05; ///< of the brightest node: what dimmer nodes are measured against
constexpr double kDim = 0.4, kMostGain = 1e4;
constexpr double kRounding = 0.5; ///< of the error: what rounding may add
constexpr double kTail2 = 0.2;    ///< of the allowed squared error: a longer tail, and the sketch is widened

/// What an error under a sun at each node counts.
std::vector<float> horizon_weights(const detail::SunColumns& columns, const SkyPartition& partition) {
  std::vector<float> weight;
  for (const std::int32_t node : columns.node)
    weight.push_back(partition.centre(node).z < 0.0 ? kBelowHorizon : 1.0f);
  return weight;
}

/// Weights under which the light of each sun has the norm 1: 1 / norm, for dim ones 1 / (kFloor * largest norm).
std::vector<float> node_weights(const std::vector<double>& norm2, const std::vector<float>& horizon) {
  const double most = norm2.empty() ? 0.0 : std::sqrt(*std::ranges::max_element(norm2));
  std::vector<float> weight(norm2.size());
  for (std::size_t i = 0; i < weight.size(); ++i)
    weight[i] = horizon[i] * static_cast<float>(1.0 / std::max({std::sqrt(norm2[i]), kFloor * most, 1e-30}));
  return weight;
}

/// sum_j w_j^2 norm_j^2: how many suns the error is a mean of; one that is dimmer than the floor counts in part.
double weighted_sum(const std::vector<double>& norm2, const std::vector<float>& weight) {
  double sum = 0;
  for (std::size_t j = 0; j < norm2.size(); ++j)
    sum += norm2[j] * static_cast<double>(weight[j]) * static_cast<double>(weight[j]);
  return sum;
}

/// An error counts relative to the light there where that is less than kDim of what probes have in the mean: a dim room
/// beside a bright one. gain = kDim rms / own rms, 1 to kMostGain.
void set_gains(std::vector<ProbeCluster>& clusters) {
  double sum = 0, points = 0;
  for (const ProbeCluster& c : clusters) {
    sum += c.power * static_cast<double>(c.point.size());
    points += static_cast<double>(c.point.size());
  }
  for (ProbeCluster& c : clusters)
    if (c.power > 0)
      c.set_gain(static_cast<float>(std::clamp(kDim * std::sqrt(sum / points / c.power), 1.0, kMostGain)));
}

/// Squared norms of the light on the sources.
std::vector<double> norms2_on_sources(const detail::SunColumns& columns) {
  std::vector<double> norm2(columns.size(), 0.0);
  for (std::size_t j = 0; j < columns.size(); ++j)
    for (std::size_t k = columns.begin[j]; k < columns.begin[j + 1]; ++k)
      norm2[j] += static_cast<double>(columns.value[k]) * static_cast<double>(columns.value[k]);
  return norm2;
}

/// Mean over the projections of the squared norms of rows over sources, which `rows_of` gives for each cluster. They
/// are large, so only those of a few clusters are kept at a time.
template <class RowsOf>
std::vector<double> norms2_at_probes(const std::vector<ProbeCluster>& clusters, const detail::SunColumns& columns,
                                     const RowsOf& rows_of) {
  constexpr std::size_t kAtOnce = 16;
  detail::JoinedRows joined(clusters.size(), kProjections, columns.sources);
  for (std::size_t first = 0; first < clusters.size(); first += kAtOnce) {
    std::vector<std::vector<float>> rows(std::min(kAtOnce, clusters.size() - first));
    parallel_for(std::size_t{0}, rows.size(), [&](std::size_t k) { rows[k] = rows_of(clusters[first + k]); });
    for (std::size_t k = 0; k < rows.size(); ++k)
      joined.add(first + k, rows[k]);
  }
  std::vector<double> norm2(columns.size(), 0.0);
  columns.add_norms2(joined.rows(), norm2);
  for (double& n : norm2)
    n /= kProjections;
  return norm2;
}

std::vector<ProbeCluster> begin(const ProbeClusters& points) {
  std::vector<ProbeCluster> clusters;
  for (const std::vector<std::uint32_t>& some : points) {
    ProbeCluster& c = clusters.emplace_back();
    c.id = clusters.size() - 1;
    c.point = some;
  }
  return clusters;
}

std::size_t components_of(const CompactFactors& factors) {
  return factors.strong.scale.size() + factors.weak.scale.size();
}

/// `counted`: weighted_sum().
CompactReport report_of(const CompactBasis& basis, const std::vector<ProbeCluster>& clusters, const SurfaceLight& light,
                        const detail::SunColumns& columns, const std::vector<float>& weight, double counted) {
  const std::size_t components = components_of(basis.nine), in_all = std::max<std::size_t>(components, 1);
  CompactReport report{.nodes = columns.size(),
                       .sources = light.source.size(),
                       .clusters = light.clusters,
                       .probe_clusters = basis.nine.cluster.size(),
                       .bytes = basis.bytes(),
                       .band4_probe_clusters = basis.band4.cluster.size(),
                       .band4_components = components_of(basis.band4),
                       .band4_bytes = basis.band4.bytes()};
  report.mean_rank = double(components) / double(std::max<std::size_t>(basis.nine.cluster.size(), 1));
  report.strong_fraction = double(basis.nine.strong.scale.size()) / double(in_all);
  const std::vector<double> error2 =
      norms2_at_probes(clusters, columns, [](const ProbeCluster& c) { return c.missed(); });
  double sum = 0;
  for (std::size_t j = 0; j < error2.size(); ++j) {
    const double e = error2[j] * static_cast<double>(weight[j]) * static_cast<double>(weight[j]);
    report.largest_error = std::max(report.largest_error, std::sqrt(e));
    sum += e;
  }
  report.rms_error = std::sqrt(sum / std::max(counted, 1e-30));
  return report;
}

std::size_t sketch_width(double at_three_percent, double error) {
  return static_cast<std::size_t>(
      std::clamp(at_three_percent * std::pow(0.03 / std::max(error, 1e-4), 0.8), 32.0, 1024.0));
}

/// Radiosity [element][columns] under suns of which each channel has a random sign.
std::vector<float> of_random_colour(const detail::SurfaceTransport& surfaces, const std::vector<float>& suns,
                                    std::size_t columns) {
  std::vector<float> sum(surfaces.elements() * columns, 0.0f);
  for (int c = 0; c < 3; ++c) {
    const std::vector<float> one = surfaces.radiosity(c, suns, columns);
    for (std::size_t k = 0; k < sum.size(); ++k)
      sum[k] += detail::random_sign(static_cast<std::uint64_t>(c) * columns + k % columns) * one[k];
  }
  return sum;
}

/// Runs a stage for all clusters, half of the progress, until somebody says stop.
class Stages {
public:
  Stages(std::vector<ProbeCluster>& clusters, const Progress& progress) : clusters_(clusters), progress_(progress) {}
  bool stopped() const { return stop_; }

  template <class Body>
  void run(const Body& body) {
    parallel_for(std::size_t{0}, clusters_.size(), [&](std::size_t b) {
      if (!stop_)
        body(clusters_[b]);
      if (!progress_("fine sky", static_cast<double>(++done_) / static_cast<double>(2 * clusters_.size())))
        stop_ = true;
    });
  }

private:
  std::vector<ProbeCluster>& clusters_;
  const Progress& progress_;
  std::atomic<std::size_t> done_{0};
  std::atomic<bool> stop_{false};
};

} // namespace

ProbeClusters probe_clusters(const ProbeSet& probes, std::span<const std::size_t> probe_of_point,
                             std::span<const std::uint32_t> part, std::size_t most) {
  std::vector<glm::vec3> position;
  for (const std::size_t p : probe_of_point)
    position.push_back(probes.positions[p]);
  return detail::neighbours(position, part, most);
}

Result<CompactBasis> compact_sky(const SurfaceLight& light, const GatherRows& gather, const ProbeClusters& points,
                                 std::span<const std::size_t> probe_of_point, const SkyPartition& partition,
                                 const CompactOptions& options, const Progress& progress, CompactReport* report) {
  const auto start = std::chrono::steady_clock::now();
  openblas_set_num_threads(1); // clusters are independent: parallel over them
  const detail::SunColumns columns = detail::SunColumns::of(light, partition.size());
  std::vector<ProbeCluster> clusters;
  if (!light.source.empty())
    clusters = begin(points);
  Stages stages(clusters, progress);

  // Suns of equal irradiance until it is known what each does to the probes.
  const std::vector<float> horizon = horizon_weights(columns, partition);
  const std::size_t range = sketch_width(kRangeAtThree, options.error);
  const detail::SurfaceTransport surfaces(light);
  const std::vector<float> radiosity =
      of_random_colour(surfaces, columns.random_suns(node_weights(norms2_on_sources(columns), horizon), range), range);
  stages.run([&](ProbeCluster& c) { c.reduce(light, surfaces, gather, radiosity, options.error); });
  if (stages.stopped())
    return interrupted_error("fine sky");

  const std::vector<double> norm2 =
      norms2_at_probes(clusters, columns, [](const ProbeCluster& c) { return c.seen.expand(c.projected); });
  const std::vector<float> weight = node_weights(norm2, horizon);
  const std::size_t width = sketch_width(kSketchAtThree, options.error);
  const detail::SunMetric metric(columns, weight, std::max(kFewestSamples, kSamples * width));
  const detail::Measure measure{columns, weight, metric};
  const double counted = weighted_sum(norm2, weight), allowed = options.error * options.error * counted,
               tail = kTail2 * allowed / static_cast<double>(std::max<std::size_t>(clusters.size(), 1));
  set_gains(clusters);
  stages.run([&](ProbeCluster& c) { c.factorise(surfaces, metric, width, tail); });
  if (stages.stopped())
    return interrupted_error("fine sky");

  detail::choose_storage(clusters, measure, (1 + kRounding * kRounding) * allowed);
  for (ProbeCluster& c : clusters)
    c.take_gain_off();
  CompactBasis basis = detail::assemble(clusters, light, metric.sigma, probe_of_point);
  if (report) {
    *report = report_of(basis, clusters, light, columns, weight, counted);
    report->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  return basis;
}

} // namespace daylit::precompute
