#pragma once

// Probe values that linear interpolation represents best.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "scene/volume.h"

namespace daylit::precompute {

/// Linear interpolation between samples of a curved function errs to one side: by h^2 f'' / 12 in the mean of a cell,
/// of 0.091 h^2 f'' rms. Values lowered by h^2 f'' / 12 leave 0.037 h^2 f'' rms: the least-squares spline to second
/// order. The second differences are those of the grid itself, along each axis where two further probes are in the air
/// and in sight of each other (the nearest such row of three beside a wall).
class ProbeFit {
public:
  /// `sees(a, b)`: nothing stands between the neighbouring probes a and b. Probes in `probe_of_point` are the valid
  /// ones.
  static ProbeFit make(const ProbeSet& grid, std::span<const std::size_t> probe_of_point,
                       const std::function<bool(std::size_t, std::size_t)>& sees);
  /// `values`: [point][numbers_per_point], changed in place. Same bits for any thread count.
  void apply(std::span<float> values, std::size_t numbers_per_point) const;
  /// The same for one point whose numbers, and those of its neighbours, come from `values_of(point, numbers)`.
  void apply(std::size_t point, std::size_t numbers, const std::function<void(std::size_t, float*)>& values_of,
             float* out) const;

private:
  /// A second difference that a point takes: outer, middle, outer.
  struct Row {
    std::uint32_t point, a, middle, b;
  };
  std::vector<Row> rows_; ///< by point
  std::size_t points_ = 0;
};

} // namespace daylit::precompute
