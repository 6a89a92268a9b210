#pragma once

// Importance samples of a Phong lobe, and where on a radiance map they lie about a direction. Vector code by Highway.
// Krivanek & Colbert 2008, "Real-time shading with filtered importance sampling".

#include <cstddef>
#include <span>
#include <vector>

#include "runtime/maps/radiance_map.h"

namespace daylit::detail {

/// Directions about +z with density (exponent + 1) / 2 pi cos^exponent: the middles of strata of equal probability,
/// turned by the golden angle from one to the next. As arrays, the count a multiple of 16, at most
/// kMost.
struct LobeSamples {
  std::vector<float> x, y, z;
  std::vector<int> level; ///< of a chain of halved maps, whose texels are nearest to what a sample stands for

  static constexpr std::size_t kMost = 1024;

  LobeSamples(double exponent, std::size_t count, double texel_sr, int levels);
  std::size_t size() const { return x.size(); }
};

/// A level of a chain of halved maps, with a border of two texels from across the folds: look-ups need no branch.
struct MipLevel {
  static constexpr int kBorder = 2;
  int side = 0, stride = 0;  ///< texels; stride = side + 2 kBorder
  std::vector<float> texels; ///< red, green, blue, 0

  explicit MipLevel(const RadianceMap& map);
  /// Cubic (Catmull & Rom 1974) at a point of the octahedral square, [0, 1]^2; what swings below 0 is 0.
  Rgb cubic(float u, float v) const;
};

/// Mean over the samples about the unit direction `axis`, each read, bilinear, in its level. Error of a sample's place:
/// 2e-6 of the square.
Rgb mean_of_samples(const LobeSamples& samples, std::span<const MipLevel> chain, const glm::vec3& axis);

} // namespace daylit::detail
