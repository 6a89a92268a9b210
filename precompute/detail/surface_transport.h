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
  using Share = LinearLight::Share;
  /// Of the light after further bounces, by patch: of an element, and of a part.
  std::span<const Share> of_element(std::size_t element) const;
  std::span<const Share> of_part(const SeenParts::Part& part) const;
  std::vector<std::uint32_t> weighted_patches(std::span<const float> weights, const SeenParts& seen) const;
  std::vector<float> on_patches(std::span<const float> weights, std::size_t rows, const SeenParts& seen,
                                std::span<const std::uint32_t> patches) const;
  std::vector<float> times_bounced(int colour, std::span<const float> weights, std::size_t rows,
                                   std::span<const std::uint32_t> patches) const;

  const SurfaceLight& light_;
  std::vector<Share> whole_;                  ///< each patch, once
  std::array<std::vector<float>, 3> bounced_; ///< per colour [patch][cluster]
};

} // namespace daylit::precompute::detail
