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
#include "precompute/detail/node_sharpening.h"
#include "radiosity/detail/sampling.h"

namespace daylit::precompute {

namespace {

constexpr std::size_t kSketch = 160;     ///< columns of the range finder: the largest rank
constexpr std::size_t kProjections = 32; ///< random signs that measure norms
constexpr double kFloor = 0.05;          ///< of the brightest node: what dimmer nodes are measured against
constexpr double kByteShare = 0.5;       ///< of the allowed error: what rounding to bytes may add

/// Number `index` of a sequence of +1 and -1.
float random_sign(std::uint64_t index) { return radiosity::mix_bits(index * 2 + 1) >> 63 != 0 ? 1.0f : -1.0f; }

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

void scale_nodes(std::vector<float>& rows, const std::vector<float>& weight) {
  for (std::size_t k = 0; k < rows.size(); ++k)
    rows[k] *= weight[k % weight.size()];
}

/// One brick on its way: numbers of points, and what the stages leave behind.
struct Brick {
  std::vector<std::uint32_t> point;
  std::vector<float> projected; ///< [projection][node]: random signs times the block, in the end weighted by node
  detail::Factors factors;
  double unseen = 0; ///< weighted squared norm of what the sketch missed
};

class Compression {
public:
  Compression(std::span<const float> coefficients, std::size_t columns, const detail::NodeSharpening& sharpening)
      : coefficients_(coefficients), columns_(columns), sharpening_(sharpening) {}

  std::size_t nodes() const { return sharpening_.region.size(); }

  /// The brick's part of the coefficients, [point, lm, channel][column].
  std::vector<float> block(const Brick& b) const {
    std::vector<float> a(b.point.size() * 27 * columns_);
    for (std::size_t p = 0; p < b.point.size(); ++p)
      std::copy_n(coefficients_.data() + b.point[p] * 27 * columns_, 27 * columns_, a.data() + p * 27 * columns_);
    return a;
  }

  void project(std::size_t number, Brick& b) const {
    const std::vector<float> a = block(b);
    const std::size_t rows = b.point.size() * 27;
    const std::vector<float> raw = detail::multiply_transposed(signs(number, rows), a, rows, kProjections, columns_);
    b.projected = sharpening_.apply(raw, kProjections, columns_);
  }

  /// Randomised singular value decomposition (Halko, Martinsson, Tropp 2011, algorithm 4.4, one power iteration: the
  /// singular values fall slowly, and the first sketch alone would miss half of them).
  void factorise(std::size_t number, const std::vector<float>& node_weight, Brick& b) const {
    const std::vector<float> a = block(b);
    const std::size_t rows = b.point.size() * 27;
    std::vector<float> sketch(nodes() * kSketch);
    for (std::size_t k = 0; k < sketch.size(); ++k)
      sketch[k] = random_sign(k);
    std::size_t width = kSketch;
    for (int pass = 0;; ++pass) {
      const std::vector<float> seen =
          detail::multiply(a, to_columns(sketch, node_weight, width), rows, columns_, width);
      const detail::Basis range = detail::orthonormal_range(seen, rows, width);
      const std::vector<float> raw = detail::multiply_transposed(range.q, a, rows, range.rank, columns_);
      std::vector<float> coordinates = sharpening_.apply(raw, range.rank, columns_);
      scale_nodes(coordinates, node_weight);
      if (pass == 1 || range.rank == 0) {
        b.factors = detail::factorise(range, rows, std::move(coordinates), nodes());
        scale_nodes(b.projected, node_weight);
        std::vector<double> missed2(nodes(), 0.0);
        b.factors.add_error2(detail::Factors::Stored::exactly, signs(number, rows), b.projected, kProjections, missed2);
        b.unseen = std::accumulate(missed2.begin(), missed2.end(), 0.0);
        return;
      }
      width = range.rank;
      sketch.resize(nodes() * width);
      for (std::size_t k = 0; k < width; ++k)
        for (std::size_t i = 0; i < nodes(); ++i)
          sketch[i * width + k] = coordinates[k * nodes() + i];
    }
  }

  std::vector<float> signs(std::size_t number, std::size_t rows) const {
    std::vector<float> s(rows * kProjections);
    for (std::size_t k = 0; k < s.size(); ++k)
      s[k] = random_sign((number + 1) * 0x100000000ull + k);
    return s;
  }

private:
  /// Weights and sharpening folded into a matrix over nodes: [column][width].
  std::vector<float> to_columns(const std::vector<float>& over_nodes, const std::vector<float>& node_weight,
                                std::size_t width) const {
    std::vector<float> out(columns_ * width, 0.0f);
    for (const detail::NodeSharpening::Term& t : sharpening_.terms)
      for (std::size_t k = 0; k < width; ++k)
        out[t.column * width + k] += t.weight * node_weight[t.node] * over_nodes[t.node * width + k];
    return out;
  }

  std::span<const float> coefficients_;
  std::size_t columns_;
  const detail::NodeSharpening& sharpening_;
};

/// Squared norm of every node's response, from the projections of all bricks.
std::vector<double> node_norms2(const std::vector<Brick>& bricks, std::size_t nodes) {
  std::vector<double> sum(nodes, 0.0);
  for (const Brick& b : bricks)
    for (std::size_t k = 0; k < b.projected.size(); ++k)
      sum[k % nodes] += static_cast<double>(b.projected[k]) * static_cast<double>(b.projected[k]) / kProjections;
  return sum;
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
void select(std::vector<Brick>& bricks, double allowed) {
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
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    bricks[b].factors.keep(rank[b]);
    for (const double r : bricks[b].factors.byte_error2()) {
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
  for (Brick& b : bricks)
    b.factors.mark_halves(limit);
}

CompactBasis assemble(const std::vector<Brick>& bricks, const detail::NodeSharpening& sharpening,
                      std::span<const std::size_t> probe_of_point) {
  CompactBasis basis;
  basis.node = sharpening.region;
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

} // namespace

Result<CompactBasis> compact_sky(std::span<const float> coefficients, const ProbeSet& probes,
                                 std::span<const std::size_t> probe_of_point, const SkyPartition& partition,
                                 std::span<const std::int32_t> stored, const CompactOptions& options,
                                 const Progress& progress, CompactReport* report) {
  const auto start = std::chrono::steady_clock::now();
  openblas_set_num_threads(1); // bricks are independent: parallel over them
  const detail::NodeSharpening sharpening = detail::sharpen_nodes(partition, stored);
  const Compression work(coefficients, stored.size(), sharpening);
  std::vector<glm::vec3> position;
  for (const std::size_t p : probe_of_point)
    position.push_back(probes.positions[p]);
  std::vector<std::uint32_t> order(position.size());
  std::iota(order.begin(), order.end(), 0u);
  std::vector<std::vector<std::uint32_t>> groups;
  if (!order.empty() && work.nodes() > 0)
    split(order, position, options.brick_probes, groups);
  std::vector<Brick> bricks(groups.size());
  tbb::parallel_for(std::size_t{0}, bricks.size(), [&](std::size_t b) {
    std::ranges::sort(groups[b]);
    bricks[b].point = std::move(groups[b]);
    work.project(b, bricks[b]);
  });
  const std::vector<double> norm2 = node_norms2(bricks, work.nodes());
  const std::vector<float> weight = node_weights(norm2);
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
  tbb::parallel_for(std::size_t{0}, bricks.size(), [&](std::size_t b) {
    if (stop)
      return;
    work.factorise(b, weight, bricks[b]);
    if (!progress("fine sky", static_cast<double>(++done) / static_cast<double>(bricks.size())))
      stop = true;
  });
  if (stop)
    return interrupted_error("fine sky");
  select(bricks, options.error * options.error * static_cast<double>(norm2.size()));
  CompactBasis basis = assemble(bricks, sharpening, probe_of_point);
  for (const float w : weight)
    basis.node_scale.push_back(1.0f / w);
  if (report) {
    std::vector<double> error2(norm2.size(), 0.0);
    for (std::size_t b = 0; b < bricks.size(); ++b)
      bricks[b].factors.add_error2(detail::Factors::Stored::rounded, work.signs(b, bricks[b].point.size() * 27),
                                   bricks[b].projected, kProjections, error2);
    const double components = static_cast<double>(basis.half_scale.size() + basis.byte_scale.size());
    *report = {basis.node.size(), basis.brick.size(), basis.bytes(), 0, 0, 0, 0, 0};
    report->mean_rank = components / static_cast<double>(std::max<std::size_t>(basis.brick.size(), 1));
    report->half_share = static_cast<double>(basis.half_scale.size()) / std::max(components, 1.0);
    for (std::size_t i = 0; i < error2.size(); ++i)
      report->largest_error = std::max(report->largest_error, std::sqrt(error2[i]));
    report->rms_error = std::accumulate(error2.begin(), error2.end(), 0.0) /
                        static_cast<double>(std::max<std::size_t>(error2.size(), 1));
    report->rms_error = std::sqrt(report->rms_error);
    report->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  return basis;
}

} // namespace daylit::precompute
