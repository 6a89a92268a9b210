#pragma once

// Importance samples of a Phong lobe, and where on a radiance map they lie about a direction. Vector code by Highway.

#include <cstddef>
#include <vector>

#include <glm/vec3.hpp>

namespace daylit::detail {

/// Directions about +z with density (exponent + 1) / 2 pi cos^exponent: the middles of strata of equal probability,
/// turned by the golden angle from one to the next. As arrays, the count a multiple of 16.
struct LobeSamples {
  std::vector<float> x, y, z;
  std::vector<float> solid_angle_sr; ///< 1 / (count x density): what a sample stands for
  std::vector<float> level;          ///< of a chain of halved maps, for texels of that solid angle

  LobeSamples(double exponent, std::size_t count, double texel_sr, int levels);
  std::size_t size() const { return x.size(); }
};

/// Points of the octahedral square, [0, 1]^2, of the samples about the unit direction `axis`: (u, v)[size()]. Error
/// 2e-6.
void sample_points(const LobeSamples& samples, const glm::vec3& axis, float* u, float* v);

} // namespace daylit::detail
