#pragma once

// The light that the sources give the elements, as products with few columns: what each source sends out itself, and
// what comes back after further bounces, which is known per cluster of sources and per patch.

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "precompute/detail/seen_parts.h"
#include "precompute/surface_light.h"

namespace daylit::precompute::detail {

class SurfaceTransport {
public:
  explicit SurfaceTransport(const SurfaceLight& light);

  std::size_t elements() const { return light_.elements; }
  std::size_t sources() const { return light_.source.size(); }

  /// Radiosity [element][columns] of a colour under irradiance [source][columns].
  std::vector<float> radiosity(int colour, std::span<const float> irradiance, std::size_t columns) const;
  /// The adjoint, as a cluster of probes sees it: weights of radiosity [row][part] of a colour become weights of
  /// irradiance, added to [row][lit part].
  void add_adjoint(int colour, std::span<const float> weights, std::size_t rows, const SeenParts& seen,
                   std::span<float> result) const;

private:
  const SurfaceLight& light_;
  std::array<std::vector<float>, 3> bounced_; ///< per colour [patch][cluster]
};

} // namespace daylit::precompute::detail
