#pragma once

// What a tile of the source can add to a tile of a blurred map at most, and how it may be summed.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "runtime/maps/detail/tiles.h"

namespace daylit::detail {

/// Interpolation of a lobe between the Chebyshev points of two tiles: an analytic function of each of the four
/// coordinates, off by at most 4 M rho^-order / (rho - 1) in one of them, M its largest magnitude on the ellipse about
/// the tile with semi-axes half (rho +- 1 / rho) / 2 (Trefethen 2013, theorem 8.2). Along a great circle
/// |cos(theta + i eta)|^2 = cos^2(theta) + sinh^2(eta).
struct SmoothLobe {
  int order = 0;
  double reach = 0.0;      ///< real semi-axis, radians: so far around the pair the lobe must be analytic
  double eta = 0.0;        ///< imaginary semi-axis
  double error_at_0 = 0.0; ///< of a pair whose ellipse holds theta = 0; the lobe is 1 there
  /// Between the pair and cos = 0, radians. cos^s is analytic beyond where s is whole, and has a branch point too weak
  /// to see where s is large.
  double clearance = 0.0;
};
/// The lowest order with error_at_0 <= wanted that is worth it, for tiles of `texels` texels and `half` radians; none
/// where a lobe is too narrow.
std::optional<SmoothLobe> smooth_lobe(double exponent, double half, std::size_t texels, double wanted);

/// For the pairs of one tile with all tiles of a source: the largest cosine between them, 0 where there is none above;
/// and the square of the largest magnitude of the cosine on the ellipse over that at theta = 0, -1 where the lobe is
/// not analytic.
struct PairBounds {
  std::vector<float> cosine, ellipse;
};
PairBounds pair_bounds(const TileFrame& tile, const Tiles& source, const SmoothLobe* smooth);

enum class Summing : std::uint8_t { skipped, at_points, at_texels };

/// A largest set of the smallest bounds whose sum stays below the budget, by powers of two: returns the limit below
/// which a bound belongs to it. Bounds are 0, positive or +infinity.
float affordable(std::span<const float> bounds, double budget);

} // namespace daylit::detail
