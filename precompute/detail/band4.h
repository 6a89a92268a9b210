#pragma once

// The coefficients of l = 4 in a cluster of probes, as a second, small pair of factors beside that of the nine: the
// same parts, suns and steps, with rows weighted by what an error in them does to irradiance.

#include <vector>

#include "precompute/detail/factors.h"
#include "precompute/detail/seen_parts.h"
#include "precompute/detail/surface_transport.h"

namespace daylit::precompute::detail {

struct Band4 {
  Basis basis;                    ///< [coefficient][rank]
  std::vector<float> coordinates; ///< [rank][part]
  Factors factors;

  /// `rows`: gather rows [coefficient][part]; `radiosity`: of the parts under random suns, [part][columns]; `left`:
  /// what the nine may lose of what they see under all these suns, squared.
  void reduce(const std::vector<float>& rows, std::size_t coefficients, const std::vector<float>& radiosity,
              std::size_t columns, double left);
  /// `suns`: [lit part][width].
  void factorise(const SurfaceTransport& surfaces, const SeenParts& seen, const SunMetric& metric,
                 const std::vector<float>& suns, std::size_t width);
  /// Keeps what is worth more than `per_byte` of squared error; takes the weight off.
  void choose_storage(double per_byte, const std::vector<float>& suns, std::size_t columns);
};

} // namespace daylit::precompute::detail
