#include "scene/local_combiner.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/detail/lane_kernels.h"
#include "scene/detail/symmetric_eigen.h"
#include "scene/detail/tile_kernels.h"

namespace daylit {

namespace {

using detail::kLanes;
using detail::kTileNumbers;

constexpr std::size_t kSketch = kLanes * detail::kMostGroups;
constexpr std::uint32_t kLargestGap = 8; ///< of unlit regions inside a run

/// What is read of a volume: the factors at the probes, [number of a colour][component], and of the sources,
/// [component][source].
struct Factors {
  std::size_t numbers = 0, components = 0, sources = 0;
  std::array<std::vector<float>, 3> probe;
  std::vector<float> source;
};

/// Components of one brick that holds wanted probes.
struct Piece {
  std::size_t brick, half, byte, probe_half, probe_byte;  ///< where its components and numbers begin
  std::vector<std::pair<std::size_t, std::size_t>> probe; ///< place in the brick, place in the result
};

std::vector<Piece> find_pieces(const CompactBasis& basis, std::span<const std::uint32_t> wanted) {
  std::vector<Piece> pieces;
  Piece at{};
  std::size_t first = 0;
  for (std::size_t b = 0; b < basis.brick.size(); ++b) {
    const CompactBasis::Brick& brick = basis.brick[b];
    Piece piece = at;
    piece.brick = b;
    for (std::size_t i = 0; i < brick.probes; ++i)
      for (std::size_t k = 0; k < wanted.size(); ++k)
        if (basis.probe[first + i] == wanted[k])
          piece.probe.emplace_back(i, k);
    if (!piece.probe.empty())
      pieces.push_back(std::move(piece));
    const std::size_t column = 3 * brick.tiles() * kTileNumbers;
    first += brick.probes;
    at.half += brick.half_rank;
    at.byte += brick.byte_rank;
    at.probe_half += column * brick.half_rank;
    at.probe_byte += column * brick.byte_rank;
  }
  return pieces;
}

Factors read_factors(const CompactBasis& basis, const std::vector<Piece>& pieces, std::size_t probes) {
  Factors f{.numbers = probes * 9, .components = 0, .sources = basis.sources, .probe = {}, .source = {}};
  for (const Piece& p : pieces)
    f.components += basis.brick[p.brick].half_rank + basis.brick[p.brick].byte_rank;
  for (std::vector<float>& colour : f.probe)
    colour.assign(f.numbers * f.components, 0.0f);
  f.source.resize(f.components * f.sources);
  std::size_t component = 0;
  for (const Piece& p : pieces) {
    const CompactBasis::Brick& brick = basis.brick[p.brick];
    for (std::size_t k = 0; k < brick.half_rank + brick.byte_rank; ++k, ++component) {
      const bool half = k < brick.half_rank;
      const std::size_t own = half ? k : k - brick.half_rank, rank = half ? brick.half_rank : brick.byte_rank,
                        all = (half ? p.half : p.byte) + own;
      const float scale = half ? basis.half_scale[all] : basis.byte_scale[all];
      for (std::size_t s = 0; s < f.sources; ++s) {
        const std::size_t i = (all / kTileNumbers * f.sources + s) * kTileNumbers + all % kTileNumbers;
        f.source[component * f.sources + s] =
            scale * (half ? detail::from_half(basis.source_half[i]) : static_cast<float>(basis.source_byte[i]));
      }
      for (const auto& [in_brick, in_result] : p.probe)
        for (std::size_t c = 0; c < 3; ++c)
          for (std::size_t l = 0; l < 9; ++l) {
            const std::size_t n = in_brick * 9 + l, tile = c * brick.tiles() + n / kTileNumbers;
            const std::size_t i =
                (half ? p.probe_half : p.probe_byte) + (tile * rank + own) * kTileNumbers + n % kTileNumbers;
            f.probe[c][(in_result * 9 + l) * f.components + component] =
                half ? detail::from_half(basis.probe_half[i]) : static_cast<float>(basis.probe_byte[i]);
          }
    }
  }
  return f;
}

/// [rows][columns] = a [rows][inner] b [inner][columns]
std::vector<float> multiply(std::span<const float> a, std::span<const float> b, std::size_t rows, std::size_t inner,
                            std::size_t columns) {
  std::vector<float> c(rows * columns, 0.0f);
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t i = 0; i < inner; ++i) {
      const float x = a[r * inner + i];
      if (x == 0.0f)
        continue; // the factors of other bricks
      for (std::size_t k = 0; k < columns; ++k)
        c[r * columns + k] += x * b[i * columns + k];
    }
  return c;
}

/// a^T a in double, a is [rows][columns].
std::vector<double> gram(std::span<const float> a, std::size_t columns) {
  std::vector<double> g(columns * columns, 0.0);
  for (std::size_t r = 0; r < a.size() / columns; ++r)
    for (std::size_t i = 0; i < columns; ++i)
      for (std::size_t k = 0; k < columns; ++k)
        g[i * columns + k] += static_cast<double>(a[r * columns + i]) * static_cast<double>(a[r * columns + k]);
  return g;
}

/// Calls visit(source, region, weight) for every number of the first light of a colour.
template <class Visit>
void for_each_weight(const CompactBasis& basis, std::size_t table, const Visit& visit) {
  const FirstLight& light = basis.light;
  for (std::size_t s = 0; s < basis.sources; ++s) {
    const std::size_t row = table * basis.sources + s;
    std::size_t at = light.first_weight[row];
    for (std::uint32_t r = light.first_run[row]; r < light.first_run[row + 1]; ++r)
      for (std::uint32_t k = 0; k < light.run[r].count; ++k, ++at)
        visit(s, light.run[r].first_region + k, light.scale[row] * detail::from_half(light.weight[at]));
  }
}

/// Light of random skies on the sources, [source][kSketch]: signs of a fixed sequence.
std::vector<float> random_light(const CompactBasis& basis) {
  std::vector<float> light(basis.sources * kSketch, 0.0f);
  const auto sign = [](std::uint64_t x) {
    x = (x + 1) * 0x9E3779B97F4A7C15ull;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
    return x ^ (x >> 27);
  };
  for_each_weight(basis, 0, [&](std::size_t s, std::uint32_t region, float w) {
    static_assert(kSketch == 64);
    const std::uint64_t bits = sign(region);
    float* row = light.data() + s * kSketch;
    for (std::size_t k = 0; k < kSketch; ++k)
      row[k] += (bits >> k & 1u) != 0 ? w : -w;
  });
  return light;
}

/// Columns k of the eigenvectors whose eigenvalues are largest, as long as what is left is above `left`.
std::vector<std::size_t> strongest(const std::vector<double>& values, double left) {
  std::vector<std::size_t> order(values.size());
  for (std::size_t k = 0; k < order.size(); ++k)
    order[k] = k;
  std::ranges::sort(order, std::greater{}, [&](std::size_t k) { return values[k]; });
  double rest = 0;
  while (!order.empty() && rest + std::max(values[order.back()], 0.0) <= left) {
    rest += std::max(values[order.back()], 0.0);
    order.pop_back();
  }
  return order;
}

} // namespace

std::size_t LocalCombiner::bytes() const {
  return table_.size() * sizeof(std::uint16_t) + (probe_.size() + scale_.size()) * sizeof(float);
}

Result<LocalCombiner> LocalCombiner::make(const BasisVolume& volume, std::span<const std::uint32_t> probes,
                                          double error) {
  if (!volume.compact)
    return Error{ErrorCode::value_invalid, "the volume has no compact basis", "local combiner", "bake it with fine:N"};
  if (probes.size() > kMostProbes || std::ranges::any_of(probes, [&](auto p) { return p >= volume.probes.size(); }))
    return Error{ErrorCode::value_invalid, "too many probes, or one that does not exist", "local combiner", ""};
  const CompactBasis& basis = *volume.compact;
  const Factors f = read_factors(basis, find_pieces(basis, probes), probes.size());
  LocalCombiner out;
  out.probes_ = probes.size();
  out.regions_ = static_cast<std::size_t>(volume.partition.size());
  out.tables_ = basis.light.rows() > basis.sources ? 3 : 1;

  // Range of what random skies do to the probes (Halko, Martinsson, Tropp 2011), rows of the three colours together.
  const std::vector<float> amplitude = multiply(f.source, random_light(basis), f.components, f.sources, kSketch);
  std::vector<float> seen;
  for (const std::vector<float>& colour : f.probe) {
    const std::vector<float> rows = multiply(colour, amplitude, f.numbers, f.components, kSketch);
    seen.insert(seen.end(), rows.begin(), rows.end());
  }
  std::vector<double> values;
  std::vector<double> vectors = detail::symmetric_eigen(gram(seen, kSketch), kSketch, values);
  double total = 0;
  for (const double v : values)
    total += std::max(v, 0.0);
  const std::vector<std::size_t> kept = strongest(values, 0.25 * error * error * total);
  const std::size_t width = kept.size();
  std::vector<float> turn(kSketch * width); // [sketch][kept]: orthonormal columns of seen * turn
  for (std::size_t k = 0; k < width; ++k)
    for (std::size_t i = 0; i < kSketch; ++i)
      turn[i * width + k] = static_cast<float>(vectors[kept[k] * kSketch + i] / std::sqrt(values[kept[k]]));
  const std::vector<float> q = multiply(seen, turn, 3 * f.numbers, kSketch, width); // [row][width]

  // q^T transport: [source][width], then onto the regions.
  std::vector<float> onto(f.components * width, 0.0f);
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t n = 0; n < f.numbers; ++n)
      for (std::size_t i = 0; i < f.components; ++i)
        if (const float x = f.probe[c][n * f.components + i]; x != 0.0f)
          for (std::size_t k = 0; k < width; ++k)
            onto[i * width + k] += x * q[(c * f.numbers + n) * width + k];
  std::vector<float> by_source(f.sources * width, 0.0f);
  for (std::size_t i = 0; i < f.components; ++i)
    for (std::size_t s = 0; s < f.sources; ++s)
      for (std::size_t k = 0; k < width; ++k)
        by_source[s * width + k] += f.source[i * f.sources + s] * onto[i * width + k];
  std::vector<std::vector<float>> by_region(out.tables_, std::vector<float>(out.regions_ * width, 0.0f));
  std::vector<std::uint8_t> lit(out.regions_, 0);
  for (std::size_t t = 0; t < out.tables_; ++t)
    for_each_weight(basis, t, [&](std::size_t s, std::uint32_t region, float w) {
      lit[region] = 1;
      float* to = by_region[t].data() + region * width;
      const float* from = by_source.data() + s * width;
      for (std::size_t k = 0; k < width; ++k)
        to[k] += w * from[k];
    });

  // The strongest components of what is left, in the mean over the sky.
  std::vector<double> power(width * width, 0.0);
  for (const std::vector<float>& table : by_region) {
    const std::vector<double> g = gram(table, std::max<std::size_t>(width, 1));
    for (std::size_t k = 0; k < power.size(); ++k)
      power[k] += g[k];
  }
  vectors = detail::symmetric_eigen(power, width, values);
  total = 0;
  for (const double v : values)
    total += std::max(v, 0.0);
  const std::vector<std::size_t> final = strongest(values, 0.5 * error * error * total);
  out.rank_ = final.size();
  out.groups_ = std::max<std::size_t>((out.rank_ + kLanes - 1) / kLanes, 1);
  const std::size_t lanes = out.groups_ * kLanes, tiles = (f.numbers + kTileNumbers - 1) / kTileNumbers;
  std::vector<float> rotate(width * lanes, 0.0f);
  for (std::size_t k = 0; k < out.rank_; ++k)
    for (std::size_t i = 0; i < width; ++i)
      rotate[i * lanes + k] = static_cast<float>(vectors[final[k] * width + i]);
  const std::vector<float> rows = multiply(q, rotate, 3 * f.numbers, width, lanes);
  out.probe_.assign(3 * tiles * lanes * kTileNumbers, 0.0f);
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t n = 0; n < f.numbers; ++n)
      for (std::size_t k = 0; k < lanes; ++k)
        out.probe_[((c * tiles + n / kTileNumbers) * lanes + k) * kTileNumbers + n % kTileNumbers] =
            rows[(c * f.numbers + n) * lanes + k];
  for (std::uint32_t r = 0; r < lit.size(); ++r) {
    if (lit[r] == 0)
      continue;
    if (out.runs_.empty() || r - (out.runs_.back().first_region + out.runs_.back().count) > kLargestGap)
      out.runs_.push_back({r, 0});
    out.runs_.back().count = r + 1 - out.runs_.back().first_region;
  }
  for (const Run& run : out.runs_)
    out.table_rows_ += run.count;
  for (const std::vector<float>& table : by_region) {
    const std::vector<float> turned = multiply(table, rotate, out.regions_, width, lanes);
    std::vector<float> most(lanes, 1e-30f);
    for (std::size_t k = 0; k < turned.size(); ++k)
      most[k % lanes] = std::max(most[k % lanes], std::abs(turned[k]));
    out.scale_.insert(out.scale_.end(), most.begin(), most.end());
    for (const Run& run : out.runs_)
      for (std::size_t k = run.first_region * lanes; k < (run.first_region + run.count) * lanes; ++k)
        out.table_.push_back(detail::to_half(turned[k] / most[k % lanes]));
  }
  return out;
}

void LocalCombiner::combine(std::span<const Rgb> region_radiance, std::span<Sh9Rgb> result) const {
  const std::size_t lanes = groups_ * kLanes, numbers = probes_ * 9,
                    tiles = (numbers + kTileNumbers - 1) / kTileNumbers;
  const detail::AddLanes add = detail::add_lanes_kernel();
  std::array<float, 3 * kSketch> sum{}, amplitude{};
  for (std::size_t t = 0; t < tables_; ++t) {
    sum.fill(0.0f);
    const std::uint16_t* table = table_.data() + t * table_rows_ * lanes;
    for (const Run& run : runs_) {
      add(table, &region_radiance[run.first_region].r, run.count, groups_, sum.data());
      table += run.count * lanes;
    }
    for (std::size_t k = 0; k < 3 * lanes; ++k)
      if (tables_ == 1 || k / lanes == t)
        amplitude[k] = sum[k] * scale_[t * lanes + k % lanes];
  }
  const detail::TileKernels& kernels = detail::tile_kernels();
  std::array<std::array<float, kTileNumbers>, 3> tile;
  std::array<detail::WeightedRow, kSketch> weights;
  for (std::size_t i = 0; i < tiles; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      tile[c].fill(0.0f);
      for (std::size_t k = 0; k < rank_; ++k)
        weights[k] = {static_cast<std::uint32_t>(k), amplitude[c * lanes + k]};
      kernels.add_float(probe_.data() + (c * tiles + i) * lanes * kTileNumbers, std::span(weights).first(rank_), 0,
                        detail::kTileBlocks, tile[c].data());
    }
    const std::size_t count = std::min(kTileNumbers, numbers - i * kTileNumbers);
    kernels.interleave(tile[0].data(), tile[1].data(), tile[2].data(), count, &result[0][0].r + 3 * i * kTileNumbers);
  }
}

} // namespace daylit
