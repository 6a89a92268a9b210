#pragma once

// The light field at the few probes around one object, frame after frame, from a volume with a compact basis.

#include <cstdint>
#include <span>
#include <vector>

#include "scene/volume.h"

namespace daylit {

/// Made once for a place of the object (some milliseconds): what the sky's nodes do to these probes alone is a matrix
/// of low rank, because the probes are neighbours. Its two factors are evaluated per frame in one pass over the sky.
/// The field differs from combine() at these probes by less than `error` of its norm, in the mean over the sky.
class LocalCombiner {
public:
  static constexpr std::size_t kMostProbes = 512;
  /// Error: the volume has no compact basis; too many probes, or one that does not exist.
  static Result<LocalCombiner> make(const BasisVolume& volume, std::span<const std::uint32_t> probes,
                                    double error = 0.02);

  /// [i] belongs to probes[i]. `region_radiance` as for combine().
  void combine(std::span<const Rgb> region_radiance, std::span<Sh9Rgb> result) const;

  std::size_t rank() const { return rank_; }
  std::size_t bytes() const;

private:
  std::size_t probes_ = 0, rank_ = 0, groups_ = 0; ///< components, and those in groups of lanes
  std::size_t regions_ = 0;                        ///< of the sky
  std::vector<FirstLight::Run> runs_;              ///< of regions that light the probes
  /// Half floats [table][region of the runs][component]; one table, or one for each colour where panes are tinted.
  std::vector<std::uint16_t> table_;
  std::vector<float> scale_; ///< [table][component]
  std::vector<float> probe_; ///< [colour][tile][component][128], numbers probe * 9 + lm
  std::size_t tables_ = 1, table_rows_ = 0;

  void add_table(const std::vector<float>& table, const FirstLight& light);
};

} // namespace daylit
