#include "scene/volume_combiner.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <numeric>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "scene/detail/tile_kernels.h"

namespace daylit {

using detail::kTileNumbers;
using detail::WeightedRow;

namespace {

constexpr std::size_t kGrain_bytes = 512 * 1024; ///< less is not worth another thread

/// Largest magnitude of a row, 1 for a black one.
float largest(const float* row, std::size_t count) {
  float most = 0;
  for (std::size_t k = 0; k < count; ++k)
    most = std::max(most, std::abs(row[k]));
  return most > 0 ? most : 1.0f;
}

} // namespace

/// The rows that count, per colour.
struct VolumeCombiner::Weights {
  std::array<std::vector<WeightedRow>, 3> rows;
  std::size_t rows_read = 0; ///< in any colour
};

VolumeCombiner VolumeCombiner::make(const BasisVolume& volume, Storage storage) {
  VolumeCombiner c;
  c.probes_ = volume.probes.size();
  c.compact_ = volume.compact;
  c.region_ = volume.stored_region;
  if (volume.compact) {
    c.region_.resize(static_cast<std::size_t>(volume.partition.size()));
    std::iota(c.region_.begin(), c.region_.end(), 0);
  }
  const std::size_t rows = c.region_.size(), numbers = c.probes_ * 9;
  c.tiles_ = (numbers + kTileNumbers - 1) / kTileNumbers;
  c.current_.assign(rows, Rgb(0.0f));
  c.field_.probe.assign(c.probes_, Sh9Rgb{});
  if (c.compact_)
    return c;
  c.row_scale_.assign(rows, 1.0f);
  c.sums_.assign(3 * c.tiles_ * kTileNumbers, 0.0f);
  const bool half = storage == Storage::float16;
  (half ? c.halves_.resize(3 * c.tiles_ * rows * kTileNumbers) : c.floats_.resize(3 * c.tiles_ * rows * kTileNumbers));
  tbb::parallel_for(std::size_t{0}, rows, [&](std::size_t r) {
    const float* row = volume.basis.data() + r * volume.row_floats();
    if (half)
      c.row_scale_[r] = largest(row, volume.row_floats());
    for (std::size_t k = 0; k < 3 * numbers; ++k) {
      const std::size_t n = k / 3, tile = (k % 3) * c.tiles_ + n / kTileNumbers;
      const std::size_t at = (tile * rows + r) * kTileNumbers + n % kTileNumbers;
      if (half)
        c.halves_[at] = detail::to_half(row[k] / c.row_scale_[r]);
      else
        c.floats_[at] = row[k];
    }
  });
  return c;
}

VolumeCombiner::Weights VolumeCombiner::weights(std::span<const Rgb> row_radiance) const {
  Weights w;
  for (std::vector<WeightedRow>& rows : w.rows)
    rows.reserve(row_radiance.size());
  for (std::size_t r = 0; r < row_radiance.size(); ++r) {
    w.rows_read += row_radiance[r] != Rgb(0.0f) ? 1 : 0;
    for (int c = 0; c < 3; ++c)
      if (row_radiance[r][c] != 0.0f)
        w.rows[static_cast<std::size_t>(c)].push_back(
            {static_cast<std::uint32_t>(r), row_radiance[r][c] * row_scale_[r]});
  }
  return w;
}

void VolumeCombiner::add_tile(const Weights& w, std::size_t colour, std::size_t tile, std::size_t first,
                              std::size_t count, float* sum) const {
  const detail::TileKernels& kernels = detail::tile_kernels();
  const std::size_t at = (colour * tiles_ + tile) * region_.size() * kTileNumbers;
  if (halves_.empty())
    kernels.add_float(floats_.data() + at, w.rows[colour], first, count, sum);
  else
    kernels.add_half(halves_.data() + at, w.rows[colour], first, count, sum);
}

void VolumeCombiner::add_all(const Weights& w) {
  const std::size_t tile_bytes = std::max<std::size_t>(w.rows_read * kTileNumbers * sizeof(float), 1);
  const tbb::blocked_range<std::size_t> all(0, 3 * tiles_, std::max<std::size_t>(kGrain_bytes / tile_bytes, 1));
  tbb::parallel_for(all, [&](const auto& tiles) {
    for (std::size_t t = tiles.begin(); t < tiles.end(); ++t)
      add_tile(w, t / tiles_, t % tiles_, 0, detail::kTileBlocks, sums_.data() + t * kTileNumbers);
  });
  const std::size_t plane = tiles_ * kTileNumbers;
  detail::tile_kernels().interleave(sums_.data(), sums_.data() + plane, sums_.data() + 2 * plane, probes_ * 9,
                                    &field_.probe[0][0].x);
}

std::size_t VolumeCombiner::bytes() const {
  return compact_ ? compact_->bytes() : floats_.size() * sizeof(float) + halves_.size() * sizeof(std::uint16_t);
}

std::size_t VolumeCombiner::update(std::span<const Rgb> region_radiance) {
  std::vector<Rgb> next(region_.size()), step(region_.size());
  std::size_t changed = 0, lit = 0;
  for (std::size_t r = 0; r < region_.size(); ++r) {
    assert(static_cast<std::size_t>(region_[r]) < region_radiance.size());
    next[r] = region_radiance[static_cast<std::size_t>(region_[r])];
    step[r] = next[r] - current_[r];
    changed += next[r] != current_[r] ? 1 : 0;
    lit += next[r] != Rgb(0.0f) ? 1 : 0;
  }
  if (changed == 0 || probes_ == 0)
    return 0;
  current_ = std::move(next);
  if (compact_) {
    combine(*compact_, region_radiance, field_.probe);
    return lit;
  }
  const bool fully = changed >= lit || ++steps_ > kRefreshAfter;
  if (fully) {
    steps_ = 0;
    std::fill(sums_.begin(), sums_.end(), 0.0f);
  }
  const Weights w = weights(fully ? current_ : step);
  add_all(w);
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
