#include "precompute/compact_sky.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <numeric>

#include <cblas.h>
#include <glm/geometric.hpp>

#include "precompute/detail/band4.h"
#include "precompute/detail/factors.h"
#include "precompute/detail/neighbours.h"
#include "precompute/detail/random_signs.h"
#include "precompute/detail/sun_metric.h"
#include "precompute/detail/surface_transport.h"
#include "scene/core/parallel.h"

namespace daylit::precompute {

namespace {

constexpr double kSketchAtThree = 140;   ///< columns of the range finder at an error of 3 %, ~ error^-0.8
constexpr double kRangeAtThree = 180;    ///< the same of what counts at all in the rows of a brick
constexpr std::size_t kProjections = 16; ///< random signs that measure norms
constexpr std::size_t kRoundingSuns = 64;
constexpr float kBelowHorizon =
    0.2f;                          ///< there is no sun: light from there is smooth, and may err more under a small one
constexpr double kFloor = 0.05;    ///< of the brightest node: what dimmer nodes are measured against
constexpr double kByteShare = 0.5; ///< of the error: what rounding may add
constexpr double kRangeShare = 0.07; ///< of the allowed error: what the rows may lose before they are factorised
constexpr double kTailShare2 = 0.2;  ///< of the allowed squared error: a longer tail, and the sketch is widened

/// One brick on its way: numbers of points, and what the stages leave behind. Its gather rows [number][leaf] are
/// basis times coordinates: neighbouring probes see the same room.
struct Brick {
  std::vector<std::uint32_t> point;
  detail::Basis basis; ///< [number][rank]
  detail::SeenParts seen;
  std::vector<float> coordinates; ///< [rank][piece]
  std::vector<float> projected;   ///< [projection][lit piece]: random signs times the transport
  detail::SunMetric own;          ///< units of the lit pieces, of which the factors know
  detail::Factors factors;
  double unseen = 0; ///< squared error of what the sketches missed
  detail::Band4 band4;

  std::size_t numbers() const { return point.size() * 9; } ///< of one colour
};

void scale_sources(std::vector<float>& rows, const std::vector<float>& sigma) {
  for (std::size_t first = 0; first < rows.size(); first += sigma.size())
    for (std::size_t s = 0; s < sigma.size(); ++s)
      rows[first + s] *= sigma[s];
}

double squares(const std::vector<float>& a) {
  double sum = 0;
  for (const float x : a)
    sum += static_cast<double>(x) * static_cast<double>(x);
  return sum;
}

std::uint64_t signs_of(std::size_t brick) { return brick + 16; }

/// Norms under random signs, and the few combinations of the gather rows that differ under suns. `radiosity`: of the
/// room under random suns of random colour, [leaf][columns].
void reduce(const SurfaceLight& light, const detail::SurfaceTransport& surfaces, const GatherRows& gather,
            const std::vector<float>& radiosity, double error, std::size_t number, Brick& b) {
  const std::size_t n = b.numbers(), columns = radiosity.size() / light.elements;
  std::vector<std::uint8_t> distinguished(light.patches, 0);
  gather.distinguished(b.point, distinguished);
  b.seen = detail::SeenParts::of(light, distinguished);
  const std::size_t pieces = b.seen.piece.size();
  std::vector<float> rows(n * pieces);
  gather.rows(b.point, b.seen.end, rows.data());
  const std::vector<float> signs = detail::random_signs(signs_of(number), 3 * n * kProjections);
  b.projected.assign(kProjections * b.seen.lit.size(), 0.0f);
  for (int c = 0; c < 3; ++c)
    surfaces.add_adjoint(c,
                         detail::multiply_transposed(
                             std::span(signs).subspan(static_cast<std::size_t>(c) * n * kProjections, n * kProjections),
                             rows, n, kProjections, pieces),
                         kProjections, b.seen, b.projected);
  const std::vector<float> means = b.seen.means(light, radiosity, columns);
  const std::vector<float> seen = detail::multiply(rows, means, n, pieces, columns);
  const double left = kRangeShare * kRangeShare * error * error * squares(seen);
  b.basis = detail::orthonormal_range(seen, n, columns, left);
  b.coordinates = detail::multiply_transposed(b.basis.q, rows, n, b.basis.rank, pieces);
  if (gather.band4_rows) {
    gather.band4_rows(b.point, b.seen.end, rows.data());
    b.band4.reduce(rows, n, means, columns, left);
  }
}

/// The metric of suns with what is drawn from it.
struct Measure {
  const detail::SunColumns& columns;
  const std::vector<float>& weight;
  const detail::SunMetric& metric;

  /// In units of each source's own, [source][count].
  std::vector<float> suns(std::size_t count) const {
    std::vector<float> sun = columns.random_suns(weight, count);
    for (std::size_t k = 0; k < sun.size(); ++k)
      sun[k] /= metric.sigma[k / count];
    return sun;
  }
};

/// `first`: suns [source][width] of the first sketch; `limit`: of the squared error that the sketch may miss.
void factorise(const detail::SurfaceTransport& surfaces, const Measure& measure, const std::vector<float>& first,
               std::size_t number, double limit, Brick& b) {
  const std::size_t rank = b.basis.rank, rows = 3 * rank, sources = surfaces.sources(), pieces = b.seen.lit.size();
  std::vector<float> transport(rows * pieces, 0.0f);
  for (int c = 0; c < 3; ++c)
    surfaces.add_adjoint(c, b.coordinates, rank, b.seen,
                         std::span(transport).subspan(static_cast<std::size_t>(c) * rank * pieces, rank * pieces));
  b.coordinates = {};
  detail::SunMetric metric = b.seen.metric(measure.metric);
  scale_sources(transport, metric.sigma);
  scale_sources(b.projected, metric.sigma);
  for (std::size_t width = first.size() / sources;; width += width / 2) {
    const std::vector<float> more = width * sources == first.size() ? std::vector<float>{} : measure.suns(width);
    const std::vector<float> suns = b.seen.suns(metric, measure.metric, more.empty() ? first : more, width);
    if (more.empty())
      b.band4.factorise(surfaces, b.seen, metric, suns, width);
    b.factors = detail::decompose(transport, rows, metric.correlation, suns, width);
    // Singular values fall like a power of their number: the tail is about as long as what was found.
    if (b.factors.rank() < width || b.factors.power.back() * static_cast<double>(width) <= limit)
      break;
  }
  b.factors.expand_rows(b.basis.q, b.numbers());
  const std::vector<float> missed = b.factors.remainder(
      detail::Factors::Taken::exactly, detail::random_signs(signs_of(number), 3 * b.numbers() * kProjections),
      b.projected, kProjections);
  b.unseen = detail::metric_trace(missed, metric.correlation, kProjections, pieces) / kProjections;
  b.basis = {};
  b.own.sigma = std::move(metric.sigma);
}

/// What an error under a sun at each node counts.
std::vector<float> horizon_shares(const detail::SunColumns& columns, const SkyPartition& partition) {
  std::vector<float> share;
  for (const std::int32_t node : columns.node)
    share.push_back(partition.centre(node).z < 0.0 ? kBelowHorizon : 1.0f);
  return share;
}

std::vector<float> node_weights(const std::vector<double>& norm2, const std::vector<float>& share) {
  const double most = norm2.empty() ? 0.0 : std::sqrt(*std::ranges::max_element(norm2));
  std::vector<float> weight(norm2.size());
  for (std::size_t i = 0; i < weight.size(); ++i)
    weight[i] = share[i] * static_cast<float>(1.0 / std::max({std::sqrt(norm2[i]), kFloor * most, 1e-30}));
  return weight;
}

/// What is certainly too weak to keep: less than this share of the allowed squared error in all.
constexpr double kCertain = 0.3;
constexpr double kStorageShare = 0.2; ///< of it, that choosing the storage may always spend

/// Leaves the strongest components of all bricks together; the squared error of the others.
double drop_weakest(std::vector<Brick>& bricks, double allowed) {
  std::vector<double> power;
  for (const Brick& b : bricks)
    power.insert(power.end(), b.factors.power.begin(), b.factors.power.end());
  std::ranges::sort(power);
  double dropped = 0, limit = -1; // summed from the small ones, never as a difference of large numbers
  for (const double p : power) {
    if (dropped + p > allowed)
      break;
    dropped += p;
    limit = p;
  }
  for (Brick& b : bricks)
    b.factors.keep(
        static_cast<std::size_t>(std::ranges::count_if(b.factors.power, [&](double p) { return p > limit; })));
  return dropped;
}

/// Chooses for the components of all bricks together how each is stored: the least bytes whose squared error, with what
/// the sketches missed, is at most `allowed`. Sketches that missed most of it leave the storage its own share: finer
/// numbers would not help.
/// Band 4 follows at the same error per byte, so that it changes nothing of the nine.
void choose_storage(std::vector<Brick>& bricks, const Measure& measure, double allowed) {
  const std::vector<float> on_sources = measure.suns(kRoundingSuns);
  const auto suns = [&](const Brick& b) { return b.seen.suns(b.own, measure.metric, on_sources, kRoundingSuns); };
  const double own = kStorageShare * allowed;
  allowed -= drop_weakest(bricks, kCertain * allowed);
  std::vector<std::vector<double>> weak_error2(bricks.size());
  parallel_for(std::size_t{0}, bricks.size(),
               [&](std::size_t b) { weak_error2[b] = bricks[b].factors.weak_error2(suns(bricks[b]), kRoundingSuns); });
  std::vector<detail::Component> list;
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    const detail::Factors& f = bricks[b].factors;
    allowed -= bricks[b].unseen;
    for (std::size_t k = 0; k < f.rank(); ++k)
      list.push_back({f.power[k], weak_error2[b][k], f.sources + f.rows});
  }
  double per_byte = 0;
  const std::vector<detail::Stored> choice = detail::cheapest(list, std::max(allowed, own), &per_byte);
  auto next = choice.begin();
  for (Brick& b : bricks) {
    const auto end = next + std::ptrdiff_t(b.factors.rank());
    b.factors.store_as({next, end});
    next = end;
  }
  parallel_for(std::size_t{0}, bricks.size(),
               [&](std::size_t b) { bricks[b].band4.choose_storage(per_byte, suns(bricks[b]), kRoundingSuns); });
}

/// The sources that bricks see as one, and what each piece of a brick is.
class Groups {
public:
  Groups(const std::vector<Brick>& bricks, const std::vector<float>& sigma, CompactBasis& basis)
      : group_of_(sigma.size(), 0), sources_(static_cast<std::uint32_t>(sigma.size())) {
    std::vector<std::uint32_t> end(sigma.size(), 0); // of the group that begins with a source
    basis.aggregate_weight.assign(sigma.size(), 0.0f);
    for (const Brick& b : bricks)
      for (std::size_t a = 0; a < b.seen.lit.size(); ++a)
        if (const auto& lit = b.seen.lit[a]; lit.end - lit.first > 1) {
          end[lit.first] = lit.end;
          for (std::uint32_t s = lit.first; s < lit.end; ++s)
            basis.aggregate_weight[s] = b.seen.share[s] * sigma[s] / b.own.sigma[a];
        }
    for (std::uint32_t s = 0; s < end.size(); ++s)
      if (end[s] != 0) {
        group_of_[s] = static_cast<std::uint32_t>(basis.aggregate.size());
        basis.aggregate.push_back({s, end[s]});
      }
  }
  void add_pieces(const detail::SeenParts& seen, std::vector<std::uint32_t>& piece) const {
    for (const detail::SeenParts::Lit& lit : seen.lit)
      piece.push_back(lit.end - lit.first > 1 ? sources_ + group_of_[lit.first] : lit.first);
  }

private:
  std::vector<std::uint32_t> group_of_;
  std::uint32_t sources_;
};

CompactBasis assemble(const std::vector<Brick>& bricks, const SurfaceLight& light, const std::vector<float>& sigma,
                      std::span<const std::size_t> probe_of_point) {
  CompactBasis basis;
  basis.light = detail::store_first_light(light, sigma);
  const Groups groups(bricks, sigma, basis);
  std::vector<const detail::Factors*> nine, band4;
  const auto add = [&](const Brick& b, const detail::Factors& factors, std::vector<const detail::Factors*>& list,
                       CompactFactors& out) {
    list.push_back(&factors);
    out.cluster.push_back({.probes = static_cast<std::uint32_t>(b.point.size())});
    groups.add_pieces(b.seen, out.source);
    for (const std::uint32_t p : b.point)
      out.probe.push_back(static_cast<std::uint32_t>(probe_of_point[p]));
  };
  for (const Brick& b : bricks) {
    add(b, b.factors, nine, basis.nine);
    if (b.band4.factors.rank() > 0)
      add(b, b.band4.factors, band4, basis.band4);
  }
  detail::store_factors(nine, basis.nine);
  detail::store_factors(band4, basis.band4);
  return basis;
}

std::vector<Brick> make_bricks(const ProbeSet& probes, std::span<const std::size_t> probe_of_point,
                               const CompactOptions& options) {
  std::vector<glm::vec3> position;
  for (const std::size_t p : probe_of_point)
    position.push_back(probes.positions[p]);
  std::vector<Brick> bricks;
  for (std::vector<std::uint32_t>& points : detail::neighbours(position, options.part, options.cluster_probes))
    bricks.emplace_back().point = std::move(points);
  return bricks;
}

CompactReport report_of(const CompactBasis& basis, const std::vector<Brick>& bricks, const SurfaceLight& light,
                        const detail::SunColumns& columns, const std::vector<float>& weight, double counted) {
  CompactReport report{.nodes = columns.size(),
                       .sources = light.source.size(),
                       .clusters = light.clusters,
                       .probe_clusters = basis.nine.cluster.size(),
                       .bytes = basis.bytes(),
                       .band4_probe_clusters = basis.band4.cluster.size(),
                       .band4_components = basis.band4.strong.scale.size() + basis.band4.weak.scale.size(),
                       .band4_bytes = basis.band4.bytes()};
  const auto strong = static_cast<double>(basis.nine.strong.scale.size()),
             components = strong + static_cast<double>(basis.nine.weak.scale.size());
  report.mean_rank = components / static_cast<double>(std::max<std::size_t>(basis.nine.cluster.size(), 1));
  report.strong_fraction = strong / std::max(components, 1.0);
  std::vector<double> error2(columns.size(), 0.0);
  std::vector<std::vector<float>> missed(bricks.size());
  parallel_for(std::size_t{0}, bricks.size(), [&](std::size_t b) {
    missed[b] = bricks[b].factors.remainder(detail::Factors::Taken::as_stored,
                                            detail::random_signs(signs_of(b), 3 * bricks[b].numbers() * kProjections),
                                            bricks[b].projected, kProjections);
    const std::vector<float>& unit = bricks[b].own.sigma;
    for (std::size_t k = 0; k < missed[b].size(); ++k)
      missed[b][k] /= unit[k % unit.size()];
    missed[b] = bricks[b].seen.expand(missed[b]);
  });
  detail::JoinedRows joined(bricks.size(), kProjections, columns.sources);
  for (std::size_t b = 0; b < bricks.size(); ++b)
    joined.add(b, missed[b]);
  columns.add_norms2(joined.rows(), error2);
  double sum = 0;
  for (std::size_t j = 0; j < error2.size(); ++j) {
    const double e = error2[j] / kProjections * static_cast<double>(weight[j]) * static_cast<double>(weight[j]);
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

/// Radiosity [leaf][columns] under suns of which each colour has a random sign.
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

} // namespace

Result<CompactBasis> compact_sky(const SurfaceLight& light, const GatherRows& gather, const ProbeSet& probes,
                                 std::span<const std::size_t> probe_of_point, const SkyPartition& partition,
                                 const CompactOptions& options, const Progress& progress, CompactReport* report) {
  const auto start = std::chrono::steady_clock::now();
  openblas_set_num_threads(1); // bricks are independent: parallel over them
  const detail::SunColumns columns = detail::SunColumns::of(light, partition.size());
  std::vector<Brick> bricks = make_bricks(probes, probe_of_point, options);
  if (light.source.empty())
    bricks.clear();
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
  const auto for_each_brick = [&](const auto& body) {
    parallel_for(std::size_t{0}, bricks.size(), [&](std::size_t b) {
      if (!stop)
        body(b);
      if (!progress("fine sky", static_cast<double>(++done) / static_cast<double>(2 * bricks.size())))
        stop = true;
    });
  };
  // Suns of equal irradiance until it is known what each does to the probes.
  std::vector<double> norm2(columns.size(), 0.0);
  for (std::size_t j = 0; j < columns.size(); ++j)
    for (std::size_t k = columns.begin[j]; k < columns.begin[j + 1]; ++k)
      norm2[j] += static_cast<double>(columns.value[k]) * static_cast<double>(columns.value[k]);
  const std::vector<float> share = horizon_shares(columns, partition);
  const double counted = std::inner_product(share.begin(), share.end(), share.begin(), 0.0);
  const std::size_t range = sketch_width(kRangeAtThree, options.error);
  const std::vector<float> suns = columns.random_suns(node_weights(norm2, share), range);
  const detail::SurfaceTransport surfaces(light);
  const std::vector<float> radiosity = of_random_colour(surfaces, suns, range);
  for_each_brick([&](std::size_t b) { reduce(light, surfaces, gather, radiosity, options.error, b, bricks[b]); });

  std::ranges::fill(norm2, 0.0);
  detail::JoinedRows joined(bricks.size(), kProjections, columns.sources);
  for (std::size_t b = 0; b < bricks.size(); ++b)
    joined.add(b, bricks[b].seen.expand(bricks[b].projected));
  columns.add_norms2(joined.rows(), norm2);
  for (double& n : norm2)
    n /= kProjections;
  const std::vector<float> weight = node_weights(norm2, share);
  const detail::SunMetric metric(columns, weight);
  const Measure measure{columns, weight, metric};
  const double allowed = options.error * options.error * counted;
  const std::vector<float> first = measure.suns(sketch_width(kSketchAtThree, options.error));
  for_each_brick([&](std::size_t b) {
    factorise(surfaces, measure, first, b, kTailShare2 * allowed / static_cast<double>(bricks.size()), bricks[b]);
  });
  if (stop)
    return interrupted_error("fine sky");
  choose_storage(bricks, measure, (1 + kByteShare * kByteShare) * allowed);
  CompactBasis basis = assemble(bricks, light, metric.sigma, probe_of_point);
  if (report) {
    *report = report_of(basis, bricks, light, columns, weight, counted);
    report->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  return basis;
}

} // namespace daylit::precompute
