#pragma once

// Combines one volume for sky after sky: nothing when no radiance changed, and few rows when few of the constant
// regions did.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "scene/volume/interpolated_probes.h"
#include "scene/volume/volume.h"

namespace daylit {

/// Invariants: field() is that of the last update(), within rounding. A full update has the bits of combine(). After
/// updates of a few regions the sums have the rounding errors of the steps behind them, bounded by a full combination
/// every kRefreshAfter steps. Results do not depend on the thread count.
class VolumeCombiner {
public:
  static constexpr int kRefreshAfter = 256;

  /// Keeps what it needs of the volume. Order 4: field().band4 too, if the volume has it.
  static VolumeCombiner make(const BasisVolume& volume, ShOrder order = ShOrder::second);

  /// `region_radiance`: one per region of the partition. Returns how many rows of the basis were read; of a compact
  /// one, all nodes or none.
  std::size_t update(std::span<const Rgb> region_radiance);
  const LightField& field() const { return field_; }

private:
  std::shared_ptr<const CompactBasis> compact_;
  std::vector<std::int32_t> region_; ///< of each row
  std::vector<float> basis_, band4_; ///< of constant regions
  std::vector<InterpolatedProbe> interpolated_;
  std::vector<Rgb> current_; ///< of each row, or node
  int steps_ = 0;            ///< since the last full combination
  LightField field_;

  std::size_t update_rows(std::span<const Rgb> region_radiance);
};

} // namespace daylit
