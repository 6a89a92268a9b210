#include "precompute/compact_sky.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <numeric>

#include <cblas.h>
#include <glm/geometric.hpp>
#include <tbb/parallel_for.h>

#include "precompute/detail/factors.h"
#include "precompute/detail/sun_metric.h"
#include "radiosity/detail/sampling.h"

namespace daylit::precompute {

namespace {

constexpr std::size_t kSketch = 144;     ///< columns of the range finder: the largest rank
constexpr std::size_t kProjections = 16; ///< random signs that measure norms
constexpr double kFloor = 0.05;          ///< of the brightest node: what dimmer nodes are measured against
constexpr double kByteShare = 0.5;       ///< of the allowed error: what rounding to bytes may add

constexpr std::size_t kMostKept = 100'000'000; ///< numbers of gather rows; more are worked out twice

/// Number `index` of a sequence of +1 and -1.
float random_sign(std::uint64_t index) { return radiosity::mix_bits(index * 2 + 1) >> 63 != 0 ? 1.0f : -1.0f; }

std::vector<float> random_signs(std::uint64_t seed, std::size_t count) {
  std::vector<float> s(count);
  for (std::size_t k = 0; k < s.size(); ++k)
    s[k] = random_sign(seed * 0x100000000ull + k);
  return s;
}

/// Splits along the longest side at the median until every group is small.
void split(std::span<std::uint32_t> points, const std::vector<glm::vec3>& position, std::size_t most,
           std::vector<std::vector<std::uint32_t>>& groups) {
  if (points.size() <= most) {
    groups.emplace_back(points.begin(), points.end());
    return;
  }
  glm::vec3 low(position[points[0]]), high(low);
  for (const std::uint32_t p : points) {
    low = glm::min(low, position[p]);
    high = glm::max(high, position[p]);
  }
  const glm::vec3 size = high - low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    return position[a][axis] != position[b][axis] ? position[a][axis] < position[b][axis] : a < b;
  };
  std::ranges::sort(points, before);
  split(points.first(points.size() / 2), position, most, groups);
  split(points.subspan(points.size() / 2), position, most, groups);
}

/// One brick on its way: numbers of points, and what the stages leave behind.
struct Brick {
  std::vector<std::uint32_t> point;
  std::vector<float> gather;    ///< rows of the points, where they are kept from one stage to the next
  std::vector<float> projected; ///< [projection][source]: random signs times the transport
  detail::Factors factors;
  double unseen = 0; ///< squared error of what the sketch missed

  std::size_t numbers() const { return point.size() * 9; } ///< of one colour
};

/// Transport from the light on the sources to the points of a brick, as products with few columns. Rows are
/// [colour][point * 9 + lm], colour after colour.
class Transport {
public:
  Transport(const SurfaceLight& light, const GatherRows& gather) : light_(light), gather_(gather) {
    for (std::size_t c = 0; c < 3; ++c) {
      bounced_[c].resize(light.elements * light.clusters);
      for (std::size_t e = 0; e < light.elements; ++e)
        std::copy_n(light.bounced.data() + (e * 3 + c) * light.clusters, light.clusters,
                    bounced_[c].data() + e * light.clusters);
    }
  }

  std::size_t sources() const { return light_.source.size(); }

  /// [numbers][element] of a brick.
  std::vector<float> gather(const Brick& b) const {
    std::vector<float> rows(b.numbers() * light_.elements);
    gather_(b.point, rows.data());
    return rows;
  }

  /// Radiosity [colour][element][width] of the room under irradiance [source][width].
  std::vector<float> radiate(const std::vector<float>& irradiance, std::size_t width) const {
    std::vector<float> mean(light_.clusters * width, 0.0f), all;
    for (std::size_t s = 0; s < sources(); ++s)
      for (std::size_t k = 0; k < width; ++k)
        mean[light_.cluster[s] * width + k] += light_.share[s] * irradiance[s * width + k];
    for (int c = 0; c < 3; ++c) {
      std::vector<float> b =
          detail::multiply(bounced_[static_cast<std::size_t>(c)], mean, light_.elements, light_.clusters, width);
      for (std::size_t s = 0; s < sources(); ++s)
        for (std::size_t k = 0; k < width; ++k)
          b[light_.source[s] * width + k] += light_.reflectance[s][c] * irradiance[s * width + k];
      all.insert(all.end(), b.begin(), b.end());
    }
    return all;
  }

  /// What the points of a brick receive, [row][width].
  std::vector<float> receive(const Brick& b, const std::vector<float>& gather, const std::vector<float>& radiosity,
                             std::size_t width) const {
    std::vector<float> rows(3 * b.numbers() * width);
    for (std::size_t c = 0; c < 3; ++c)
      detail::multiply_into(gather, std::span(radiosity).subspan(c * light_.elements * width, light_.elements * width),
                            b.numbers(), light_.elements, width,
                            std::span(rows).subspan(c * b.numbers() * width, b.numbers() * width));
    return rows;
  }

  /// The adjoint: [width][source] from weights of the rows [row][width].
  std::vector<float> adjoint(const Brick& b, const std::vector<float>& gather, const std::vector<float>& weights,
                             std::size_t width) const {
    std::vector<float> out(width * sources(), 0.0f), by_cluster(width * light_.clusters, 0.0f);
    for (std::size_t c = 0; c < 3; ++c) {
      const std::vector<float> v =
          detail::multiply_transposed(std::span(weights).subspan(c * b.numbers() * width, b.numbers() * width), gather,
                                      b.numbers(), width, light_.elements);
      const std::vector<float> further = detail::multiply(v, bounced_[c], width, light_.elements, light_.clusters);
      for (std::size_t k = 0; k < by_cluster.size(); ++k)
        by_cluster[k] += further[k];
      for (std::size_t k = 0; k < width; ++k)
        for (std::size_t s = 0; s < sources(); ++s)
          out[k * sources() + s] +=
              light_.reflectance[s][static_cast<int>(c)] * v[k * light_.elements + light_.source[s]];
    }
    for (std::size_t k = 0; k < width; ++k)
      for (std::size_t s = 0; s < sources(); ++s)
        out[k * sources() + s] += light_.share[s] * by_cluster[k * light_.clusters + light_.cluster[s]];
    return out;
  }

private:
  const SurfaceLight& light_;
  const GatherRows& gather_;
  std::array<std::vector<float>, 3> bounced_; ///< [element][cluster]
};

void scale_sources(std::vector<float>& rows, const std::vector<float>& sigma) {
  for (std::size_t k = 0; k < rows.size(); ++k)
    rows[k] *= sigma[k % sigma.size()];
}

/// Randomised singular value decomposition in the metric of suns (Halko, Martinsson, Tropp 2011, algorithm 4.4, one
/// power iteration: the singular values fall slowly, and the first sketch alone would miss half of them).
/// `first`: radiosity of the room under kSketch random suns.
void factorise(const Transport& transport, const detail::SunMetric& metric, const std::vector<float>& first,
               std::size_t number, Brick& b) {
  const std::vector<float> gather = b.gather.empty() ? transport.gather(b) : std::move(b.gather);
  b.gather = {};
  const std::size_t rows = 3 * b.numbers(), sources = transport.sources();
  std::vector<float> seen = transport.receive(b, gather, first, kSketch);
  std::size_t width = kSketch;
  for (int pass = 0;; ++pass) {
    const detail::Basis range = detail::orthonormal_range(seen, rows, width);
    std::vector<float> coordinates =
        range.rank > 0 ? transport.adjoint(b, gather, range.q, range.rank) : std::vector<float>{};
    scale_sources(coordinates, metric.sigma);
    if (pass == 1 || range.rank == 0) {
      b.factors = detail::factorise(range, rows, std::move(coordinates), sources, metric.correlation);
      scale_sources(b.projected, metric.sigma);
      const std::vector<float> missed = b.factors.remainder(
          detail::Factors::Stored::exactly, random_signs(number + 1, rows * kProjections), b.projected, kProjections);
      b.unseen = detail::metric_trace(missed, metric.correlation, kProjections, sources) / kProjections;
      return;
    }
    width = range.rank;
    std::vector<float> sun = detail::multiply_by_transposed(metric.correlation, coordinates, sources, sources, width);
    for (std::size_t s = 0; s < sources; ++s)
      for (std::size_t k = 0; k < width; ++k)
        sun[s * width + k] *= metric.sigma[s];
    seen = transport.receive(b, gather, transport.radiate(sun, width), width);
  }
}

/// Irradiance [source][kSketch] of random suns, each node weighted by `weight`.
std::vector<float> random_suns(const detail::SunColumns& columns, const std::vector<float>& weight) {
  std::vector<float> sun(columns.sources * kSketch, 0.0f);
  for (std::size_t j = 0; j < columns.size(); ++j)
    for (std::size_t k = columns.begin[j]; k < columns.begin[j + 1]; ++k) {
      const float value = columns.value[k] * weight[j];
      float* row = sun.data() + columns.source[k] * kSketch;
      for (std::size_t i = 0; i < kSketch; ++i)
        row[i] += value * random_sign(j * kSketch + i);
    }
  return sun;
}

std::vector<float> node_weights(const std::vector<double>& norm2) {
  const double most = norm2.empty() ? 0.0 : std::sqrt(*std::ranges::max_element(norm2));
  std::vector<float> weight(norm2.size());
  for (std::size_t i = 0; i < weight.size(); ++i)
    weight[i] = static_cast<float>(1.0 / std::max({std::sqrt(norm2[i]), kFloor * most, 1e-30}));
  return weight;
}

/// Keeps the strongest components of all bricks together, until what is left is below `allowed`; then the strongest
/// roundings become half floats, until the rest of them is below its share.
void select(std::vector<Brick>& bricks, const std::vector<float>& metric, double allowed) {
  struct Component {
    double power;
    std::size_t brick;
  };
  std::vector<Component> list;
  double left = 0; // summed from the small ones, never as a difference of large numbers
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    left += bricks[b].unseen;
    for (const double power : bricks[b].factors.power)
      list.push_back({power, b});
  }
  std::ranges::stable_sort(list, std::greater{}, &Component::power);
  std::size_t kept = list.size();
  while (kept > 0 && left + list[kept - 1].power <= allowed)
    left += list[--kept].power;
  std::vector<std::size_t> rank(bricks.size(), 0);
  for (std::size_t k = 0; k < kept; ++k)
    ++rank[list[k].brick];
  std::vector<Component> rounding;
  double total = 0;
  std::vector<std::vector<double>> byte_error2(bricks.size());
  tbb::parallel_for(std::size_t{0}, bricks.size(), [&](std::size_t b) {
    bricks[b].factors.keep(rank[b]);
    byte_error2[b] = bricks[b].factors.byte_error2(metric);
  });
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    for (const double r : byte_error2[b]) {
      rounding.push_back({r, b});
      total += r;
    }
  }
  std::ranges::stable_sort(rounding, std::greater{}, &Component::power);
  double limit = 0;
  for (const Component& c : rounding) {
    limit = c.power;
    if (total <= kByteShare * kByteShare * allowed)
      break;
    total -= c.power;
    limit = 0;
  }
  for (std::size_t b = 0; b < bricks.size(); ++b)
    bricks[b].factors.mark_halves(byte_error2[b], limit);
}

CompactBasis assemble(const std::vector<Brick>& bricks, const SurfaceLight& light, const std::vector<float>& sigma,
                      std::span<const std::size_t> probe_of_point) {
  CompactBasis basis;
  basis.sources = static_cast<std::uint32_t>(light.source.size());
  basis.light = detail::store_first_light(light, sigma);
  std::vector<const detail::Factors*> factors;
  for (const Brick& b : bricks) {
    factors.push_back(&b.factors);
    basis.brick.push_back({static_cast<std::uint32_t>(b.point.size()), 0, 0});
    for (const std::uint32_t p : b.point)
      basis.probe.push_back(static_cast<std::uint32_t>(probe_of_point[p]));
  }
  detail::store_factors(factors, basis);
  return basis;
}

std::vector<Brick> make_bricks(const ProbeSet& probes, std::span<const std::size_t> probe_of_point,
                               std::size_t brick_probes) {
  std::vector<glm::vec3> position;
  for (const std::size_t p : probe_of_point)
    position.push_back(probes.positions[p]);
  std::vector<std::uint32_t> order(position.size());
  std::iota(order.begin(), order.end(), 0u);
  std::vector<std::vector<std::uint32_t>> groups;
  if (!order.empty())
    split(order, position, brick_probes, groups);
  std::vector<Brick> bricks(groups.size());
  for (std::size_t b = 0; b < groups.size(); ++b) {
    std::ranges::sort(groups[b]);
    bricks[b].point = std::move(groups[b]);
  }
  return bricks;
}

CompactReport report_of(const CompactBasis& basis, const std::vector<Brick>& bricks, const SurfaceLight& light,
                        const detail::SunColumns& columns, const std::vector<float>& weight,
                        const std::vector<float>& sigma) {
  CompactReport report{.nodes = columns.size(),
                       .sources = light.source.size(),
                       .clusters = light.clusters,
                       .bricks = basis.brick.size(),
                       .bytes = basis.bytes()};
  const double components = static_cast<double>(basis.half_scale.size() + basis.byte_scale.size());
  report.mean_rank = components / static_cast<double>(std::max<std::size_t>(basis.brick.size(), 1));
  report.half_share = static_cast<double>(basis.half_scale.size()) / std::max(components, 1.0);
  std::vector<double> error2(columns.size(), 0.0);
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    std::vector<float> missed = bricks[b].factors.remainder(detail::Factors::Stored::rounded,
                                                            random_signs(b + 1, 3 * bricks[b].numbers() * kProjections),
                                                            bricks[b].projected, kProjections);
    for (std::size_t k = 0; k < missed.size(); ++k)
      missed[k] /= sigma[k % sigma.size()];
    columns.add_norms2(missed, error2);
  }
  double sum = 0;
  for (std::size_t j = 0; j < error2.size(); ++j) {
    const double e = error2[j] / kProjections * static_cast<double>(weight[j]) * static_cast<double>(weight[j]);
    report.largest_error = std::max(report.largest_error, std::sqrt(e));
    sum += e;
  }
  report.rms_error = std::sqrt(sum / static_cast<double>(std::max<std::size_t>(error2.size(), 1)));
  return report;
}

} // namespace

Result<CompactBasis> compact_sky(const SurfaceLight& light, const GatherRows& gather, const ProbeSet& probes,
                                 std::span<const std::size_t> probe_of_point, const SkyPartition& partition,
                                 const CompactOptions& options, const Progress& progress, CompactReport* report) {
  const auto start = std::chrono::steady_clock::now();
  openblas_set_num_threads(1); // bricks are independent: parallel over them
  const Transport transport(light, gather);
  const detail::SunColumns columns = detail::SunColumns::of(light, partition.size());
  std::vector<Brick> bricks = make_bricks(probes, probe_of_point, options.brick_probes);
  if (light.source.empty())
    bricks.clear();
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
  const auto for_each_brick = [&](const auto& body) {
    tbb::parallel_for(std::size_t{0}, bricks.size(), [&](std::size_t b) {
      if (!stop)
        body(b);
      if (!progress("fine sky", static_cast<double>(++done) / static_cast<double>(2 * bricks.size())))
        stop = true;
    });
  };
  const bool keep = 9 * probe_of_point.size() * light.elements <= kMostKept;
  for_each_brick([&](std::size_t b) {
    Brick& brick = bricks[b];
    brick.gather = transport.gather(brick);
    brick.projected =
        transport.adjoint(brick, brick.gather, random_signs(b + 1, 3 * brick.numbers() * kProjections), kProjections);
    if (!keep)
      brick.gather = {};
  });
  std::vector<double> norm2(columns.size(), 0.0);
  for (const Brick& b : bricks)
    columns.add_norms2(b.projected, norm2);
  for (double& n : norm2)
    n /= kProjections;
  const std::vector<float> weight = node_weights(norm2);
  const detail::SunMetric metric(columns, weight);
  const std::vector<float> first = transport.radiate(random_suns(columns, weight), kSketch);
  for_each_brick([&](std::size_t b) { factorise(transport, metric, first, b, bricks[b]); });
  if (stop)
    return interrupted_error("fine sky");
  select(bricks, metric.correlation, options.error * options.error * static_cast<double>(norm2.size()));
  CompactBasis basis = assemble(bricks, light, metric.sigma, probe_of_point);
  if (report) {
    *report = report_of(basis, bricks, light, columns, weight, metric.sigma);
    report->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  return basis;
}

} // namespace daylit::precompute
