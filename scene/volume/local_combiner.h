#pragma once

// The light field at the few probes around one object, frame after frame, from a volume with a compact basis.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "scene/volume/volume.h"

namespace daylit {

namespace detail {
struct LocalSkyData;
}

/// What all places in a volume share, made once (a tenth of a second): what random skies do to every component of the
/// basis, and the first light sorted by regions of the sky.
class LocalSky {
public:
  /// Error: the volume has no compact basis.
  static Result<LocalSky> make(const BasisVolume& volume);

private:
  friend class LocalCombiner;
  std::shared_ptr<const detail::LocalSkyData> data_;
};

/// Made once for a place of the object (some milliseconds): what the sky's regions do to these probes alone is a matrix
/// of low rank, because the probes are neighbours. Its two factors are evaluated per frame in one pass over the sky.
/// The rank (at most 64) follows from `error`, the share of the norm that random skies may lose. Measured at 0.02 in a
/// room with one opening: 0.4 to 0.9 % under a sky that is lit all over, 3.0 to 4.2 % where one region alone is lit.
class LocalCombiner {
public:
  static constexpr std::size_t kMostProbes = 512;
  /// Error: too many probes, or one that does not exist.
  static Result<LocalCombiner> make(const LocalSky& sky, std::span<const std::uint32_t> probes, double error = 0.02);

  /// [i] belongs to probes[i]. `region_radiance` as for combine().
  void combine(std::span<const Rgb> region_radiance, std::span<Sh9Rgb> result) const;

  std::size_t rank() const { return rank_; }
  std::size_t bytes() const;

private:
  std::shared_ptr<const detail::LocalSkyData> sky_;
  std::size_t rank_ = 0;
  CompactFactors::Brick brick_; ///< of the probes, as a volume has them
  /// [table][quad of regions][component, in whole quads][4] as the runs of the sky have it (detail/plane_kernels.h);
  /// one table, or one for each colour where panes are tinted.
  std::vector<std::int8_t> table_;
  std::vector<float> scale_; ///< [table][component], the product of the units of both factors
  std::vector<std::int8_t> probe_;

  std::size_t table_planes() const { return (rank_ + 3) / 4 * 4; }
  std::vector<float> set_probes(const std::vector<float>& rows, std::size_t lanes);
  void add_table(const std::vector<float>& table, const std::vector<float>& probe_unit);
  void add_amplitudes(const std::int8_t* table, std::span<const Rgb> region_radiance, std::span<float> sum) const;
};

} // namespace daylit
