#pragma once

// Probe values that linear interpolation represents best.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "scene/volume/volume.h"

namespace daylit::precompute {

/// Linear interpolation between samples of a curved function errs to one side: by h^2 f'' / 12 in the mean of a cell,
/// of 0.091 h^2 f'' rms. Values lowered by h^2 f'' / 12 leave 0.037 h^2 f'' rms: the least-squares spline to second
/// order. Between unequal distances a and b it is (a^2 - a b + b^2) f'' / 12, the mass matrix's answer for a parabola.
/// The second differences are those of the grid itself, along each axis where a probe sees one on both sides: that of
/// others, beside a wall, is another function's. What a surface at a distance d sends changes within d, and is no
/// parabola between probes more than d apart: no fit there.
class ProbeFit {
public:
  /// `sees(a, b)`: nothing stands between the neighbouring probes a and b. `off_surfaces_m(probe)`: the distance of the
  /// nearest surface. Probes in `probe_of_point` are the valid ones.
  static ProbeFit make(const ProbeSet& grid, std::span<const std::size_t> probe_of_point,
                       const std::function<bool(std::size_t, std::size_t)>& sees,
                       const std::function<double(std::size_t)>& off_surfaces_m);
  /// Which of the air's parts each point is in: steps between neighbouring probes that see each other connect them. One
  /// part without a grid.
  const std::vector<std::uint32_t>& part() const { return part_; }
  /// `values`: [point][values_per_point], changed in place. Same bits for any thread count.
  void apply(std::span<float> values, std::size_t values_per_point) const;
  /// Points whose values the fit of some points takes, in increasing order.
  std::vector<std::uint32_t> needed(std::span<const std::uint32_t> points) const;
  /// The same for some points, whose neighbours' values are asked for: [i] belongs to points[i].
  void apply(std::span<const std::uint32_t> points, std::size_t values_per_point,
             const std::function<void(std::uint32_t point, float* values)>& value, float* result) const;

private:
  /// A point between two others, and what the steps to these count.
  struct Row {
    std::uint32_t point, a, b;
    float to_a, to_b;
  };
  std::vector<Row> rows_; ///< in the order of their points
  std::size_t points_ = 0;
  std::vector<std::uint32_t> part_;
};

} // namespace daylit::precompute
