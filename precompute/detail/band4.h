#pragma once

// The coefficients of l = 4 in a brick of probes, as a second, small pair of factors beside that of the nine: the same
// pieces, suns and steps, with rows weighted by what an error in them does to irradiance.

#include <span>
#include <vector>

#include "precompute/detail/factors.h"
#include "precompute/detail/seen_parts.h"
#include "precompute/detail/surface_transport.h"

namespace daylit::precompute::detail {

struct Band4 {
  Basis basis;                    ///< [number][rank]
  std::vector<float> coordinates; ///< [rank][piece]
  Factors factors;

  /// `rows`: gather rows [number][piece]; `radiosity`: of the pieces under random suns, [piece][columns]; `left`: what
  /// the nine may lose of what they see under all these suns, squared.
  void reduce(const std::vector<float>& rows, std::size_t numbers, const std::vector<float>& radiosity,
              std::size_t columns, double left);
  /// `suns`: [lit piece][width].
  void factorise(const SurfaceTransport& surfaces, const SeenParts& seen, const SunMetric& metric,
                 const std::vector<float>& suns, std::size_t width);
  /// Keeps what is worth more than `per_byte` of squared error; takes the weight off.
  void choose_storage(double per_byte, const std::vector<float>& suns, std::size_t columns);
};

} // namespace daylit::precompute::detail
