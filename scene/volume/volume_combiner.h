#pragma once

// Combines one volume for sky after sky at the speed of memory: the basis is kept in tiles, as float32 or in fixed
// point of 16 bits, and only what changed is added.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/volume/huge_pages.h"
#include "scene/volume/volume.h"

namespace daylit {

namespace detail {
struct FixedRows;
}

/// A volume with a compact basis is combined from its factors: nothing when no radiance changed, else all of it.
/// Invariants: field() is that of the last update(). update() with unchanged radiances touches nothing; a row whose
/// region is black is not read, which changes no bit; combine_at() gives the bits that a full combination has at those
/// probes. After update() of a few regions the sums have rounding errors of the steps behind them, bounded by a full
/// combination every kRefreshAfter steps. Results do not depend on the thread count.
/// Fixed point: numbers of 14 bits, with one scale for each row and one for each tile (14 probes); the weights are
/// rounded as finely, once for all tiles (detail/tile_kernels.h). Errors stay below 2e-4 of the largest coefficient,
/// half the bytes are read, and no number needs to be converted.
class VolumeCombiner {
public:
  enum class Storage { float32, fixed16 };
  static constexpr int kRefreshAfter = 256;

  /// Order 4: field().band4 too, if the volume has it. Order 2 neither keeps nor reads anything of it.
  static VolumeCombiner make(const BasisVolume& volume, Storage storage = Storage::fixed16,
                             ShOrder order = ShOrder::second);

  /// `region_radiance`: one per region of the partition. Returns how many rows of the basis were read; of a
  /// compact one, all nodes or none.
  std::size_t update(std::span<const Rgb> region_radiance);
  const LightField& field() const { return field_; }

  /// The nine coefficients at a few probes only, from their own part of the basis: [i] belongs to probes[i].
  std::vector<Sh9Rgb> combine_at(std::span<const Rgb> region_radiance, std::span<const std::uint32_t> probes) const;

  /// Size of the stored basis, bytes.
  std::size_t bytes() const;
  /// The tiles that a full update reads; empty for a compact basis.
  std::span<const std::byte> tiles() const;

private:
  std::shared_ptr<const CompactBasis> compact_;
  std::size_t probes_ = 0, tiles_ = 0; ///< tiles of one colour
  std::vector<std::int32_t> region_;   ///< of each row, or of each node
  /// [colour][tile][row][128], or [colour][tile][row / 2][128][2]; one of the two is empty.
  detail::HugeVector<float> floats_;
  detail::HugeVector<std::int16_t> fixed_;
  std::vector<float> row_scale_;  ///< [colour][row], rows in whole pairs
  std::vector<float> tile_scale_; ///< [colour][tile]
  std::vector<Rgb> current_;      ///< radiance of each row's region at the last update
  std::vector<Rgb> change_;       ///< from the one before; kept for its memory
  int steps_ = 0;                 ///< since the last full combination
  LightField field_;
  std::vector<VolumeCombiner> band4_; ///< of constant regions: empty, or one whose numbers are those of l = 4

  struct Weights;
  static VolumeCombiner of_rows(const BasisVolume& volume, const std::vector<float>& basis, Storage storage);
  void keep_floats(const BasisVolume& volume, const std::vector<float>& basis);
  void keep_fixed(const BasisVolume& volume, const std::vector<float>& basis);
  std::size_t padded_rows() const { return (region_.size() + 1) / 2 * 2; }
  /// Of a tile in memory. Tiles a multiple of 4 KB apart would meet in few sets of the caches: the same rows of all
  /// tiles, read again for step after step, would not stay there.
  std::size_t float_stride() const { return region_.size() + (region_.size() % 8 == 0 ? 1 : 0); }
  std::size_t fixed_stride() const { return padded_rows() + (padded_rows() % 16 == 0 ? 2 : 0); }
  bool in_cache() const;
  Weights weights(std::span<const Rgb> row_radiance) const;
  detail::FixedRows fixed_rows(std::span<const Rgb> row_radiance, int colour, std::vector<float>& weight) const;
  void add_tile(const Weights& weights, std::size_t colour, std::size_t tile, std::size_t first, std::size_t count,
                float* sum) const;
  void prefetch_tile(const Weights& weights, std::size_t tile) const;
  void add_all(const Weights& weights, bool anew);
};

} // namespace daylit
