#include "scene/volume/volume_combiner.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>
#include <numeric>

#include <unistd.h>

#include "scene/core/parallel.h"
#include "scene/core/tile_kernels.h"

namespace daylit {

using detail::kTileNumbers;
using detail::WeightedRow;

namespace {

constexpr std::size_t kGrain_bytes = 512 * 1024; ///< less is not worth another thread

} // namespace

/// The rows that count, per colour.
struct VolumeCombiner::Weights {
  std::array<std::vector<WeightedRow>, 3> rows; ///< of floats
  std::array<detail::FixedRows, 3> fixed;
  std::size_t rows_read = 0; ///< in any colour
};

VolumeCombiner VolumeCombiner::make(const BasisVolume& volume, Storage storage, ShOrder order) {
  const bool band4 = order == ShOrder::fourth && volume.has_band4();
  if (volume.compact) {
    VolumeCombiner c;
    c.probes_ = volume.probes.size();
    c.compact_ = volume.compact;
    c.region_.resize(static_cast<std::size_t>(volume.partition.size()));
    std::iota(c.region_.begin(), c.region_.end(), 0);
    c.current_.assign(c.region_.size(), Rgb(0.0f));
    c.field_.probe.assign(c.probes_, Sh9Rgb{});
    c.field_.band4.assign(band4 ? c.probes_ : 0, Band4Rgb{});
    return c;
  }
  VolumeCombiner c = of_rows(volume, volume.basis, storage);
  if (band4) {
    c.band4_.push_back(of_rows(volume, volume.band4, storage));
    c.field_.band4 = c.band4_[0].field_.probe;
  }
  return c;
}

VolumeCombiner VolumeCombiner::of_rows(const BasisVolume& volume, const std::vector<float>& basis, Storage storage) {
  VolumeCombiner c;
  c.probes_ = volume.probes.size();
  c.region_ = volume.stored_region;
  c.tiles_ = (c.probes_ * 9 + kTileNumbers - 1) / kTileNumbers;
  c.current_.assign(c.region_.size(), Rgb(0.0f));
  c.field_.probe.assign(c.probes_, Sh9Rgb{});
  storage == Storage::float32 ? c.keep_floats(volume, basis) : c.keep_fixed(volume, basis);
  return c;
}

void VolumeCombiner::keep_floats(const BasisVolume& volume, const std::vector<float>& basis) {
  const std::size_t rows = region_.size(), numbers = probes_ * 9;
  floats_.resize(3 * tiles_ * float_stride() * kTileNumbers);
  parallel_for(std::size_t{0}, rows, [&](std::size_t r) {
    const float* row = basis.data() + r * volume.row_floats();
    for (std::size_t k = 0; k < 3 * numbers; ++k) {
      const std::size_t n = k / 3, tile = (k % 3) * tiles_ + n / kTileNumbers;
      floats_[(tile * float_stride() + r) * kTileNumbers + n % kTileNumbers] = row[k];
    }
  });
}

void VolumeCombiner::keep_fixed(const BasisVolume& volume, const std::vector<float>& basis) {
  const std::size_t rows = padded_rows(), numbers = probes_ * 9;
  fixed_.resize(3 * tiles_ * fixed_stride() * kTileNumbers);
  row_scale_.assign(3 * rows, 0.0f);
  tile_scale_.assign(3 * tiles_, 0.0f);
  // Visits the numbers of each row of a colour's tile.
  const auto each_row = [&](std::size_t tile, const auto& visit) {
    const std::size_t colour = tile / tiles_, first = tile % tiles_ * kTileNumbers;
    for (std::size_t r = 0; r < region_.size(); ++r)
      visit(r, row_scale_[colour * rows + r], basis.data() + r * volume.row_floats() + 3 * first + colour,
            std::min(kTileNumbers, numbers - first));
  };
  const auto largest = [](const float* row, std::size_t count) {
    float most = 0;
    for (std::size_t k = 0; k < count; ++k)
      most = std::max(most, std::abs(row[3 * k]));
    return most;
  };
  for (std::size_t tile = 0; tile < 3 * tiles_; ++tile)
    each_row(tile, [&](std::size_t, float& scale, const float* row, std::size_t count) {
      scale = std::max(scale, largest(row, count));
    });
  for (float& scale : row_scale_) // a row of numbers below the normal range is black
    scale = std::isnormal(scale / detail::kFixedMost) ? scale / detail::kFixedMost : 0.0f;
  parallel_for(std::size_t{0}, 3 * tiles_, [&](std::size_t tile) {
    each_row(tile, [&](std::size_t, float scale, const float* row, std::size_t count) {
      if (scale > 0)
        tile_scale_[tile] = std::max(tile_scale_[tile], largest(row, count) / (scale * detail::kFixedMost));
    });
    each_row(tile, [&](std::size_t r, float row_scale, const float* row, std::size_t count) {
      const float scale = row_scale * tile_scale_[tile];
      if (!std::isnormal(scale))
        return;
      std::int16_t* out = fixed_.data() + (tile * fixed_stride() + r / 2 * 2) * kTileNumbers + r % 2;
      for (std::size_t k = 0; k < count; ++k)
        out[2 * k] = static_cast<std::int16_t>(std::lrint(row[3 * k] / scale));
    });
  });
}

VolumeCombiner::Weights VolumeCombiner::weights(std::span<const Rgb> row_radiance) const {
  Weights w;
  for (const Rgb& radiance : row_radiance)
    w.rows_read += radiance != Rgb(0.0f) ? 1 : 0;
  std::vector<float> of_colour;
  for (int c = 0; c < 3; ++c)
    if (fixed_.empty()) {
      for (std::uint32_t r = 0; r < row_radiance.size(); ++r)
        if (const float x = row_radiance[r][c]; x != 0.0f)
          w.rows[static_cast<std::size_t>(c)].push_back({r, x});
    } else {
      w.fixed[static_cast<std::size_t>(c)] = fixed_rows(row_radiance, c, of_colour);
    }
  return w;
}

/// One colour, pairs of rows that are not both black. `weight`: to work in.
detail::FixedRows VolumeCombiner::fixed_rows(std::span<const Rgb> row_radiance, int colour,
                                             std::vector<float>& weight) const {
  const std::size_t rows = padded_rows();
  weight.assign(rows, 0.0f);
  std::vector<std::uint32_t> pairs;
  pairs.reserve(rows / 2);
  for (std::size_t r = 0; r < row_radiance.size(); ++r)
    weight[r] = row_radiance[r][colour];
  for (std::uint32_t p = 0; p < rows / 2; ++p)
    if (weight[2 * p] != 0.0f || weight[2 * p + 1] != 0.0f)
      pairs.push_back(p);
  return {weight, std::span(row_scale_).subspan(static_cast<std::size_t>(colour) * rows, rows), std::move(pairs),
          !in_cache()};
}

void VolumeCombiner::add_tile(const Weights& w, std::size_t colour, std::size_t tile, std::size_t first,
                              std::size_t count, float* sum) const {
  const detail::TileKernels& kernels = detail::tile_kernels();
  const std::size_t at = colour * tiles_ + tile;
  if (fixed_.empty())
    kernels.add_float(floats_.data() + at * float_stride() * kTileNumbers, w.rows[colour], first, count, sum);
  else
    kernels.add_fixed(fixed_.data() + at * fixed_stride() * kTileNumbers, tile_scale_[at], w.fixed[colour], first,
                      count, sum);
}

/// Few rows of a tile: no prefetch of the processor finds those of the next one.
void VolumeCombiner::prefetch_tile(const Weights& w, std::size_t tile) const {
  constexpr std::size_t kFew = 16, kLine = 64;
  const auto prefetch = [](const auto* row, std::size_t numbers) {
    const char* at = reinterpret_cast<const char*>(row);
    for (std::size_t k = 0; k < numbers * sizeof(*row); k += kLine)
      __builtin_prefetch(at + k);
  };
  for (std::size_t c = 0; c < 3 && tile < tiles_ && w.rows_read <= kFew && !in_cache(); ++c) {
    const std::size_t at = c * tiles_ + tile;
    for (const WeightedRow& r : w.rows[c])
      prefetch(floats_.data() + (at * float_stride() + r.row) * kTileNumbers, kTileNumbers);
    for (const std::uint32_t p : w.fixed[c].pair)
      prefetch(fixed_.data() + (at * fixed_stride() + 2 * p) * kTileNumbers, 2 * kTileNumbers);
  }
}

void VolumeCombiner::add_all(const Weights& w, bool anew) {
  const std::size_t number_bytes = fixed_.empty() ? sizeof(float) : sizeof(std::int16_t),
                    tile_bytes = std::max<std::size_t>(3 * w.rows_read * kTileNumbers * number_bytes, 1);
  const tbb::blocked_range<std::size_t> all(0, tiles_, std::max<std::size_t>(kGrain_bytes / tile_bytes, 1));
  float* const field = &field_.probe[0][0].x;
  parallel_for(all, [&](const auto& tiles) {
    for (std::size_t t = tiles.begin(); t < tiles.end(); ++t) {
      prefetch_tile(w, t + 1);
      std::array<float, 3 * kTileNumbers> sum{};
      for (std::size_t c = 0; c < 3; ++c)
        add_tile(w, c, t, 0, detail::kTileBlocks, sum.data() + c * kTileNumbers);
      const std::size_t count = std::min(kTileNumbers, probes_ * 9 - t * kTileNumbers);
      const detail::TileKernels& kernels = detail::tile_kernels();
      (anew ? kernels.interleave : kernels.add_interleaved)(
          sum.data(), sum.data() + kTileNumbers, sum.data() + 2 * kTileNumbers, count, field + 3 * t * kTileNumbers);
    }
  });
}

/// Whether the processor's second cache holds the tiles.
bool VolumeCombiner::in_cache() const {
  static const long cache_bytes = std::max(sysconf(_SC_LEVEL2_CACHE_SIZE), 0L);
  return tiles().size() < static_cast<std::size_t>(cache_bytes);
}

std::size_t VolumeCombiner::bytes() const {
  return compact_ ? compact_->bytes()
                  : (floats_.size() + row_scale_.size() + tile_scale_.size()) * sizeof(float) +
                        fixed_.size() * sizeof(std::int16_t) + (band4_.empty() ? 0 : band4_[0].bytes());
}

std::span<const std::byte> VolumeCombiner::tiles() const {
  return fixed_.empty() ? std::as_bytes(std::span(floats_)) : std::as_bytes(std::span(fixed_));
}

std::size_t VolumeCombiner::update(std::span<const Rgb> region_radiance) {
  if (compact_) {
    assert(region_radiance.size() == current_.size());
    if (probes_ == 0 || std::memcmp(current_.data(), region_radiance.data(), region_radiance.size_bytes()) == 0)
      return 0;
    std::ranges::copy(region_radiance, current_.begin());
    combine(*compact_, region_radiance, field_.probe, field_.band4);
    return current_.size();
  }
  if (!band4_.empty() && band4_[0].update(region_radiance) > 0)
    field_.band4 = band4_[0].field_.probe;
  change_.resize(region_.size());
  std::size_t changed = 0, lit = 0;
  for (std::size_t r = 0; r < region_.size(); ++r) {
    assert(static_cast<std::size_t>(region_[r]) < region_radiance.size());
    const Rgb next = region_radiance[static_cast<std::size_t>(region_[r])];
    change_[r] = next - current_[r];
    changed += next != current_[r] ? 1 : 0;
    lit += next != Rgb(0.0f) ? 1 : 0;
    current_[r] = next;
  }
  if (changed == 0 || probes_ == 0)
    return 0;
  const bool fully = changed >= lit || ++steps_ > kRefreshAfter;
  if (fully)
    steps_ = 0;
  const Weights w = weights(fully ? current_ : change_);
  add_all(w, fully);
  return w.rows_read;
}

std::vector<Sh9Rgb> VolumeCombiner::combine_at(std::span<const Rgb> region_radiance,
                                               std::span<const std::uint32_t> probes) const {
  if (compact_) {
    std::vector<Sh9Rgb> all(probes_), some(probes.size());
    daylit::combine_at(*compact_, region_radiance, probes, all);
    for (std::size_t i = 0; i < probes.size(); ++i)
      some[i] = all[probes[i]];
    return some;
  }
  std::vector<Rgb> row_radiance(region_.size());
  for (std::size_t r = 0; r < region_.size(); ++r)
    row_radiance[r] = region_radiance[static_cast<std::size_t>(region_[r])];
  const Weights w = weights(row_radiance);

  // Bit b of needed[t]: block b of tile t holds a number that is asked for.
  std::vector<std::uint8_t> needed(tiles_, 0);
  for (const std::uint32_t p : probes)
    for (std::size_t block = p * 9 / detail::kBlockNumbers; block <= (p * 9 + 8) / detail::kBlockNumbers; ++block)
      needed[block / detail::kTileBlocks] |= static_cast<std::uint8_t>(1u << block % detail::kTileBlocks);
  std::vector<std::size_t> place(tiles_, 0);
  std::size_t count = 0;
  for (std::size_t t = 0; t < tiles_; ++t)
    if (needed[t] != 0)
      place[t] = count++;
  std::vector<float> sums(3 * count * kTileNumbers, 0.0f);
  for (std::size_t t = 0; t < tiles_; ++t)
    for (unsigned bits = needed[t], first = 0; bits >> first != 0;) {
      first += static_cast<unsigned>(std::countr_zero(bits >> first));
      const auto run = static_cast<unsigned>(std::countr_one(bits >> first));
      for (std::size_t c = 0; c < 3; ++c)
        add_tile(w, c, t, first, run, sums.data() + (c * count + place[t]) * kTileNumbers);
      first += run;
    }
  std::vector<Sh9Rgb> result(probes.size());
  for (std::size_t i = 0; i < probes.size(); ++i)
    for (std::size_t l = 0; l < 9; ++l) {
      const std::size_t n = probes[i] * std::size_t{9} + l, tile = place[n / kTileNumbers];
      for (std::size_t c = 0; c < 3; ++c)
        result[i][l][static_cast<int>(c)] = sums[(c * count + tile) * kTileNumbers + n % kTileNumbers];
    }
  return result;
}

} // namespace daylit
