#include "scene/volume/local_combiner.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/core/parallel.h"
#include "scene/volume/brick_sums.h"
#include "scene/volume/local_sky.h"
#include "scene/volume/plane_kernels.h"
#include "scene/volume/symmetric_eigen.h"

namespace daylit {

namespace {

using detail::kLanes;
using detail::kQuad;
using detail::kSketch;
using detail::LocalFactors;
using detail::LocalSkyData;

// Plain loops that the compiler turns into vectors of any width.
#define DAYLIT_ANY_WIDTH __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))

constexpr std::size_t kGrain = 256; ///< rows; fewer are not worth another thread
constexpr std::size_t kWords = 4;   ///< the strongest components: bytes would add half as much error as the rank leaves
constexpr std::size_t kChunkRows = detail::kChunkRows, kChunkQuads = kChunkRows / kQuad;

constexpr std::array<std::uint32_t, kChunkQuads> kInOrder = [] {
  std::array<std::uint32_t, kChunkQuads> list{};
  for (std::uint32_t q = 0; q < kChunkQuads; ++q)
    list[q] = q;
  return list;
}();

/// A group of lanes anywhere in memory, in as few registers as the processor has it.
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float)), aligned(alignof(float)), may_alias));
inline const Lanes& lanes_at(const float* p) { return *reinterpret_cast<const Lanes*>(p); }
inline Lanes& lanes_at(float* p) { return *reinterpret_cast<Lanes*>(p); }

/// kRows rows of c [rows][columns] += a [rows][inner] b [inner][columns], one group of lanes: independent sums hide the
/// latency of each other.
template <std::size_t kRows>
__attribute__((always_inline)) inline void multiply_lanes(const float* a, const float* b, std::size_t inner,
                                                          std::size_t columns, float* c) {
  Lanes sum[kRows] = {};
  for (std::size_t i = 0; i < inner; ++i)
#pragma GCC unroll 8
    for (std::size_t r = 0; r < kRows; ++r)
      sum[r] += a[r * inner + i] * lanes_at(b + i * columns);
  for (std::size_t r = 0; r < kRows; ++r)
    lanes_at(c + r * columns) += sum[r];
}

/// c [rows][columns] += a [rows][inner] b [inner][columns]; columns in whole groups of lanes.
DAYLIT_ANY_WIDTH void multiply_rows(const float* a, const float* b, std::size_t rows, std::size_t inner,
                                    std::size_t columns, float* c) {
  constexpr std::size_t kTogether = 8;
  for (std::size_t first = 0; first < columns; first += kLanes) {
    std::size_t r = 0;
    for (; r + kTogether <= rows; r += kTogether)
      multiply_lanes<kTogether>(a + r * inner, b + first, inner, columns, c + r * columns + first);
    for (; r < rows; ++r)
      multiply_lanes<1>(a + r * inner, b + first, inner, columns, c + r * columns + first);
  }
}

std::vector<float> multiply(std::span<const float> a, std::span<const float> b, std::size_t rows, std::size_t inner,
                            std::size_t columns) {
  std::vector<float> c(rows * columns, 0.0f);
  parallel_for(tbb::blocked_range<std::size_t>(0, rows, kGrain), [&](const auto& part) {
    multiply_rows(a.data() + part.begin() * inner, b.data(), part.size(), inner, columns,
                  c.data() + part.begin() * columns);
  });
  return c;
}

/// g [columns][columns] += a^T a, the upper half and a little more; columns in whole groups of lanes.
DAYLIT_ANY_WIDTH void add_gram(const float* a, std::size_t rows, std::size_t columns, double* g) {
  constexpr std::size_t kRowsOfFloats = 64, kTogether = 8; // as many rows are summed in float32, columns at once
  for (std::size_t begin = 0; begin < rows; begin += kRowsOfFloats)
    for (std::size_t i = 0; i < columns; i += kTogether)
      for (std::size_t first = i / kLanes * kLanes; first < columns; first += kLanes) {
        Lanes sum[kTogether] = {};
        for (std::size_t r = begin; r < std::min(begin + kRowsOfFloats, rows); ++r)
#pragma GCC unroll 8
          for (std::size_t k = 0; k < kTogether; ++k)
            sum[k] += a[r * columns + i + k] * lanes_at(a + r * columns + first);
        for (std::size_t k = 0; k < kTogether; ++k)
          for (std::size_t lane = 0; lane < kLanes; ++lane)
            g[(i + k) * columns + first + lane] += static_cast<double>(sum[k][lane]);
      }
}

/// The strongest principal directions of rows [row][columns], until what is left is below `left` of the whole:
/// [columns][kept, whole groups of lanes], each divided by its norm if `unit`.
std::vector<float> principal(std::span<const std::vector<float>> tables, std::size_t columns, double left, bool unit,
                             std::size_t& kept) {
  std::vector<double> g(columns * columns, 0.0), values;
  for (const std::vector<float>& t : tables)
    add_gram(t.data(), t.size() / columns, columns, g.data());
  for (std::size_t i = 0; i < columns; ++i) // the upper half is whole
    for (std::size_t k = 0; k < i; ++k)
      g[i * columns + k] = g[k * columns + i];
  const std::vector<double> vectors = detail::symmetric_eigen(std::move(g), columns, values);
  double total = 0, rest = 0;
  std::vector<std::size_t> order(columns);
  for (std::size_t k = 0; k < columns; ++k) {
    order[k] = k;
    values[k] = std::max(values[k], 0.0);
    total += values[k];
  }
  std::ranges::sort(order, std::greater{}, [&](std::size_t k) { return values[k]; });
  for (; !order.empty() && rest + values[order.back()] <= left * total; order.pop_back())
    rest += values[order.back()];
  kept = order.size();
  const std::size_t lanes = std::max<std::size_t>((kept + kLanes - 1) / kLanes, 1) * kLanes;
  std::vector<float> turn(columns * lanes, 0.0f);
  for (std::size_t k = 0; k < kept; ++k)
    for (std::size_t i = 0; i < columns; ++i)
      turn[i * lanes + k] =
          static_cast<float>(vectors[order[k] * columns + i] / (unit ? std::sqrt(values[order[k]]) : 1.0));
  return turn;
}

/// Orthonormal columns [colour, number][lanes] whose span holds what random skies do to the probes (Halko, Martinsson,
/// Tropp 2011).
std::vector<float> range_of(const LocalFactors& f, double left) {
  std::vector<float> seen;
  for (const std::vector<float>& colour : f.probe) {
    const std::vector<float> rows = multiply(colour, f.seen, f.numbers, f.components, kSketch);
    seen.insert(seen.end(), rows.begin(), rows.end());
  }
  std::size_t kept = 0;
  const std::vector<float> turn = principal(std::span(&seen, 1), kSketch, left, true, kept);
  return multiply(seen, turn, 3 * f.numbers, kSketch, turn.size() / kSketch);
}

/// The sums over the sources of one region.
template <std::size_t kGroups>
__attribute__((always_inline)) inline void add_groups(std::span<const LocalSkyData::Weight> weights,
                                                      const float* by_source, float* row) {
  Lanes sum[kGroups] = {};
  for (const LocalSkyData::Weight& w : weights)
#pragma GCC unroll 4
    for (std::size_t g = 0; g < kGroups; ++g)
      sum[g] += w.weight * lanes_at(by_source + (w.source * kGroups + g) * kLanes);
  for (std::size_t g = 0; g < kGroups; ++g)
    lanes_at(row + g * kLanes) = sum[g];
}

DAYLIT_ANY_WIDTH void add_region(std::span<const LocalSkyData::Weight> weights, const float* by_source,
                                 std::size_t groups, float* row) {
  static_assert(detail::kMostGroups == 4);
  groups == 1   ? add_groups<1>(weights, by_source, row)
  : groups == 2 ? add_groups<2>(weights, by_source, row)
  : groups == 3 ? add_groups<3>(weights, by_source, row)
                : add_groups<4>(weights, by_source, row);
}

/// The adjoint on the regions of the sky: a table [row][lanes] for each colour of the first light.
std::vector<std::vector<float>> onto_regions(const LocalSkyData& sky, const LocalFactors& f,
                                             const std::vector<float>& q) {
  const std::size_t lanes = q.size() / (3 * f.numbers);
  std::vector<float> onto(f.components * lanes, 0.0f), transposed(f.components * f.numbers);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t n = 0; n < f.numbers; ++n)
      for (std::size_t i = 0; i < f.components; ++i)
        transposed[i * f.numbers + n] = f.probe[c][n * f.components + i];
    multiply_rows(transposed.data(), q.data() + c * f.numbers * lanes, f.components, f.numbers, lanes, onto.data());
  }
  const std::vector<float> by_source = multiply(f.source, onto, f.sources, f.components, lanes);
  std::vector<std::vector<float>> by_region;
  for (const LocalSkyData::Table& table : sky.table) {
    std::vector<float>& rows = by_region.emplace_back(sky.rows * lanes);
    parallel_for(tbb::blocked_range<std::size_t>(0, sky.rows, kGrain), [&](const auto& part) {
      for (std::size_t r = part.begin(); r < part.end(); ++r)
        add_region(std::span(table.weight).subspan(table.first[r], table.first[r + 1] - table.first[r]),
                   by_source.data(), lanes / kLanes, rows.data() + r * lanes);
    });
  }
  return by_region;
}

/// The largest of each lane of rows [row][lanes], never 0.
std::vector<float> largest_of_lanes(const std::vector<float>& rows, std::size_t lanes) {
  std::vector<float> most(lanes, 1e-30f);
  for (std::size_t k = 0; k < rows.size(); ++k)
    most[k % lanes] = std::max(most[k % lanes], std::abs(rows[k]));
  return most;
}

} // namespace

Result<LocalSky> LocalSky::make(const BasisVolume& volume) {
  if (!volume.compact)
    return Error{ErrorCode::value_invalid, "the volume has no compact basis", "local combiner", "bake it with fine:N"};
  LocalSky sky;
  sky.data_ = std::make_shared<const LocalSkyData>(
      detail::make_local_sky(volume.compact, volume.probes.size(), static_cast<std::size_t>(volume.partition.size())));
  return sky;
}

std::size_t LocalCombiner::bytes() const { return table_.size() + probe_.size() + scale_.size() * sizeof(float); }

Result<LocalCombiner> LocalCombiner::make(const LocalSky& sky, std::span<const std::uint32_t> probes, double error) {
  const LocalSkyData& data = *sky.data_;
  if (probes.empty() || probes.size() > kMostProbes ||
      std::ranges::any_of(probes, [&](auto p) { return p >= data.probes; }))
    return Error{ErrorCode::value_invalid, "no probes, too many, or one that does not exist", "local combiner", ""};
  const LocalFactors f = detail::local_factors(data, probes);
  LocalCombiner out;
  out.sky_ = sky.data_;
  const std::vector<float> q = range_of(f, 0.25 * error * error);
  const std::size_t width = q.size() / (3 * f.numbers);
  const std::vector<std::vector<float>> by_region = onto_regions(data, f, q);
  const std::vector<float> turn = principal(by_region, width, 0.5 * error * error, false, out.rank_);
  const std::size_t lanes = turn.size() / width;
  const std::vector<float> probe = multiply(q, turn, 3 * f.numbers, width, lanes);
  const std::vector<float> unit = out.set_probes(probe, lanes);
  for (const std::vector<float>& table : by_region)
    out.add_table(multiply(table, turn, data.rows, width, lanes), unit);
  return out;
}

/// Numbers [colour, number][lane] in the order of a brick. Returns the unit of each component.
std::vector<float> LocalCombiner::set_probes(const std::vector<float>& rows, std::size_t lanes) {
  const std::size_t numbers = rows.size() / 3 / lanes, words = std::min(rank_, kWords);
  brick_ = {.probes = static_cast<std::uint32_t>(numbers / 9),
            .word_rank = static_cast<std::uint32_t>(words),
            .byte_rank = static_cast<std::uint32_t>(rank_ - words)};
  std::vector<float> unit = largest_of_lanes(rows, lanes);
  for (std::size_t k = 0; k < lanes; ++k)
    unit[k] /= k < words ? static_cast<float>(detail::kWeightMost) : 127.0f;
  probe_.assign(brick_.probe_bytes(), 0);
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t n = 0; n < numbers; ++n)
      for (std::size_t k = 0; k < rank_; ++k) {
        const long x = std::lrint(rows[(c * numbers + n) * lanes + k] / unit[k]), high = (x + 128) >> 8;
        probe_[brick_.probe_at(words + k, c, n)] = static_cast<std::int8_t>(x - (k < words ? 256 * high : 0));
        if (k < words)
          probe_[brick_.probe_at(k, c, n)] = static_cast<std::int8_t>(high);
      }
  return unit;
}

/// Rounds a table [row][lane] and puts its rows in quads.
void LocalCombiner::add_table(const std::vector<float>& table, const std::vector<float>& probe_unit) {
  const std::size_t lanes = probe_unit.size(), planes = table_planes();
  std::vector<float> unit = largest_of_lanes(table, lanes);
  for (std::size_t k = 0; k < rank_; ++k)
    scale_.push_back((unit[k] /= 127.0f) * probe_unit[k]);
  const std::size_t first = table_.size();
  table_.resize(first + (sky_->rows + kQuad - 1) / kQuad * kQuad * planes, 0);
  for (std::size_t row = 0; row < sky_->rows; ++row)
    for (std::size_t k = 0; k < rank_; ++k)
      table_[first + (row / kQuad * planes + k) * kQuad + row % kQuad] =
          static_cast<std::int8_t>(std::lrint(table[row * lanes + k] / unit[k]));
}

/// What the components receive of the sky: [colour][component, in whole quads], of the table at `table`.
void LocalCombiner::add_amplitudes(const std::int8_t* table, std::span<const Rgb> region_radiance,
                                   std::span<float> sum) const {
  const detail::PlaneKernels& kernels = detail::plane_kernels();
  const std::size_t planes = table_planes();
  std::array<Rgb, kChunkRows> radiance;
  std::array<detail::ColourWeights, kChunkQuads> weight;
  std::array<float, 3 * kSketch> part;
  std::size_t rows = 0;
  for (std::size_t r = 0; r < sky_->run.size(); ++r) {
    const LocalSkyData::Run& run = sky_->run[r];
    std::copy_n(region_radiance.begin() + run.first_region, run.count, radiance.begin() + rows);
    rows += run.count;
    if (rows < kChunkRows && r + 1 < sky_->run.size())
      continue;
    const std::size_t quads = (rows + kQuad - 1) / kQuad;
    const float step = kernels.round_quads(std::span(radiance).first(rows), weight.data());
    part.fill(0.0f);
    kernels.sum_planes(table, planes, std::span(kInOrder).first(quads), weight.data(), part.data());
    for (std::size_t k = 0; k < sum.size(); ++k)
      sum[k] += step * part[k];
    table += quads * kQuad * planes;
    rows = 0;
  }
}

void LocalCombiner::combine(std::span<const Rgb> region_radiance, std::span<Sh9Rgb> result) const {
  const std::size_t planes = table_planes(), tables = sky_->table.size();
  std::array<float, 3 * kSketch> sum, amplitude;
  for (std::size_t t = 0; t < tables; ++t) {
    sum.fill(0.0f);
    add_amplitudes(table_.data() + t * (table_.size() / tables), region_radiance, std::span(sum).first(3 * planes));
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < rank_ && (tables == 1 || c == t); ++k)
        amplitude[c * rank_ + k] = sum[c * planes + k] * scale_[t * rank_ + k];
  }
  detail::sum_brick(brick_, probe_.data(), std::span(amplitude).first(3 * rank_), result);
}

} // namespace daylit
