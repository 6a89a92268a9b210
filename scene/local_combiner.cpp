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

// Plain loops that the compiler turns into vectors of any width.
#define DAYLIT_ANY_WIDTH __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))

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

/// to[k] += x * from[k]
DAYLIT_ANY_WIDTH void add_scaled(float x, const float* from, std::size_t count, float* to) {
  for (std::size_t k = 0; k < count; ++k)
    to[k] += x * from[k];
}

/// [rows][columns] = a [rows][inner] b [inner][columns]
DAYLIT_ANY_WIDTH void multiply_into(const float* a, const float* b, std::size_t rows, std::size_t inner,
                                    std::size_t columns, float* c) {
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t i = 0; i < inner; ++i) {
      const float x = a[r * inner + i];
      if (x == 0.0f)
        continue; // the factors of other bricks
      for (std::size_t k = 0; k < columns; ++k)
        c[r * columns + k] += x * b[i * columns + k];
    }
}

std::vector<float> multiply(std::span<const float> a, std::span<const float> b, std::size_t rows, std::size_t inner,
                            std::size_t columns) {
  std::vector<float> c(rows * columns, 0.0f);
  multiply_into(a.data(), b.data(), rows, inner, columns, c.data());
  return c;
}

std::vector<float> transposed(std::span<const float> a, std::size_t rows, std::size_t columns) {
  std::vector<float> t(a.size());
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t c = 0; c < columns; ++c)
      t[c * rows + r] = a[r * columns + c];
  return t;
}

DAYLIT_ANY_WIDTH void add_gram(const float* a, std::size_t rows, std::size_t columns, double* g) {
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t i = 0; i < columns; ++i) {
      const double x = static_cast<double>(a[r * columns + i]);
      for (std::size_t k = 0; k < columns; ++k)
        g[i * columns + k] += x * static_cast<double>(a[r * columns + k]);
    }
}

/// The strongest principal directions of rows [row][columns], until what is left is below `left` of the whole:
/// [columns][kept], each divided by its norm if `unit`.
std::vector<float> principal(const std::vector<std::vector<float>>& tables, std::size_t columns, double left, bool unit,
                             std::size_t& kept) {
  std::vector<double> g(columns * columns, 0.0), values;
  for (const std::vector<float>& t : tables)
    add_gram(t.data(), columns > 0 ? t.size() / columns : 0, columns, g.data());
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
  std::vector<float> turn(columns * kept);
  for (std::size_t k = 0; k < kept; ++k)
    for (std::size_t i = 0; i < columns; ++i)
      turn[i * kept + k] =
          static_cast<float>(vectors[order[k] * columns + i] / (unit ? std::sqrt(values[order[k]]) : 1.0));
  return turn;
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

/// Orthonormal columns [colour, number][width] whose span holds what random skies do to the probes (Halko, Martinsson,
/// Tropp 2011).
std::vector<float> range_of(const CompactBasis& basis, const Factors& f, double left, std::size_t& width) {
  const std::vector<float> amplitude = multiply(f.source, random_light(basis), f.components, f.sources, kSketch);
  std::vector<float> seen;
  for (const std::vector<float>& colour : f.probe) {
    const std::vector<float> rows = multiply(colour, amplitude, f.numbers, f.components, kSketch);
    seen.insert(seen.end(), rows.begin(), rows.end());
  }
  const std::vector<float> turn = principal({seen}, kSketch, left, true, width);
  return multiply(seen, turn, 3 * f.numbers, kSketch, width);
}

/// The adjoint on the regions of the sky, a table [region][width] for each colour of the first light.
std::vector<std::vector<float>> onto_regions(const CompactBasis& basis, const Factors& f, const std::vector<float>& q,
                                             std::size_t width, std::size_t regions, std::size_t tables) {
  std::vector<float> onto(f.components * width, 0.0f);
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t n = 0; n < f.numbers; ++n)
      for (std::size_t i = 0; i < f.components; ++i)
        if (const float x = f.probe[c][n * f.components + i]; x != 0.0f)
          add_scaled(x, q.data() + (c * f.numbers + n) * width, width, onto.data() + i * width);
  const std::vector<float> by_source =
      multiply(transposed(f.source, f.components, f.sources), onto, f.sources, f.components, width);
  std::vector<std::vector<float>> by_region(tables, std::vector<float>(regions * width, 0.0f));
  for (std::size_t t = 0; t < tables; ++t)
    for_each_weight(basis, t, [&](std::size_t s, std::uint32_t region, float w) {
      add_scaled(w, by_source.data() + s * width, width, by_region[t].data() + region * width);
    });
  return by_region;
}

/// Numbers [colour, number][lane] in tiles.
std::vector<float> in_tiles(const std::vector<float>& rows, std::size_t numbers, std::size_t lanes) {
  const std::size_t tiles = (numbers + kTileNumbers - 1) / kTileNumbers;
  std::vector<float> out(3 * tiles * lanes * kTileNumbers, 0.0f);
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t n = 0; n < numbers; ++n)
      for (std::size_t k = 0; k < lanes; ++k)
        out[((c * tiles + n / kTileNumbers) * lanes + k) * kTileNumbers + n % kTileNumbers] =
            rows[(c * numbers + n) * lanes + k];
  return out;
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

  std::size_t width = 0;
  const std::vector<float> q = range_of(basis, f, 0.25 * error * error, width);
  const std::vector<std::vector<float>> by_region = onto_regions(basis, f, q, width, out.regions_, out.tables_);
  const std::vector<float> turn = principal(by_region, width, 0.5 * error * error, false, out.rank_);
  out.groups_ = std::max<std::size_t>((out.rank_ + kLanes - 1) / kLanes, 1);
  const std::size_t lanes = out.groups_ * kLanes;
  std::vector<float> rotate(width * lanes, 0.0f);
  for (std::size_t i = 0; i < width; ++i)
    std::copy_n(turn.data() + i * out.rank_, out.rank_, rotate.data() + i * lanes);
  out.probe_ = in_tiles(multiply(q, rotate, 3 * f.numbers, width, lanes), f.numbers, lanes);
  for (const std::vector<float>& table : by_region)
    out.add_table(multiply(table, rotate, out.regions_, width, lanes), basis.light);
  return out;
}

void LocalCombiner::add_table(const std::vector<float>& table, const FirstLight& light) {
  const std::size_t lanes = groups_ * kLanes;
  if (runs_.empty()) {
    std::vector<std::uint8_t> lit(regions_, 0);
    for (const FirstLight::Run& run : light.run)
      std::fill_n(lit.begin() + run.first_region, run.count, std::uint8_t{1});
    for (std::uint32_t r = 0; r < lit.size(); ++r) {
      if (lit[r] == 0)
        continue;
      if (runs_.empty() || r - (runs_.back().first_region + runs_.back().count) > kLargestGap)
        runs_.push_back({r, 0});
      runs_.back().count = r + 1 - runs_.back().first_region;
    }
    for (const FirstLight::Run& run : runs_)
      table_rows_ += run.count;
  }
  std::vector<float> most(lanes, 1e-30f);
  for (std::size_t k = 0; k < table.size(); ++k)
    most[k % lanes] = std::max(most[k % lanes], std::abs(table[k]));
  scale_.insert(scale_.end(), most.begin(), most.end());
  for (const FirstLight::Run& run : runs_)
    for (std::size_t k = run.first_region * lanes; k < (run.first_region + run.count) * lanes; ++k)
      table_.push_back(detail::to_half(table[k] / most[k % lanes]));
}

void LocalCombiner::combine(std::span<const Rgb> region_radiance, std::span<Sh9Rgb> result) const {
  const std::size_t lanes = groups_ * kLanes, numbers = probes_ * 9,
                    tiles = (numbers + kTileNumbers - 1) / kTileNumbers;
  const detail::AddLanes add = detail::add_lanes_kernel();
  std::array<float, 3 * kSketch> sum{}, amplitude{};
  for (std::size_t t = 0; t < tables_; ++t) {
    sum.fill(0.0f);
    const std::uint16_t* table = table_.data() + t * table_rows_ * lanes;
    for (const FirstLight::Run& run : runs_) {
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
