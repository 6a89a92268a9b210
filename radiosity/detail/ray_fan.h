#pragma once

// The directions in which every point looks, and sums of spherical harmonics over those that meet the same patch.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace daylit::radiosity {

/// Which nine numbers of the light at a point: coefficients of l <= 2, of l = 4, or irradiance on the axes +x, -x, +y,
/// -y, +z, -z and three zeros.
enum class Bands { low, fourth, axes };

/// The rays of every point, each point's turned about z by an angle of its own: a spherical Fibonacci lattice, in an
/// order in which sixteen in a row are close together.
struct RayFan {
  static constexpr std::size_t kStride = 16;
  std::vector<glm::vec3> direction;
  std::vector<float> harmonics; ///< [ray][16]: nine Y_lm(ray) times 4 / rays (dw / pi), then zeros
  std::vector<float> band4;     ///< the same of l = 4

  static RayFan of(int rays);
  const std::vector<float>& of(Bands bands) const { return bands == Bands::low ? harmonics : band4; }
  /// The same of irradiance on the axes, the rays turned about z.
  std::vector<float> axes(const glm::vec2& turn) const;
};

/// Cosines with the axes of Bands::axes; 0 behind.
std::array<float, 9> axis_cosines(const glm::vec3& direction);

/// Cosine and sine of the angle by which a point's rays are turned about z: a function of its index only.
glm::vec2 turn_of(std::size_t point);

/// sum[aggregate_of[met[ray]]][kStride] += harmonics[ray] for all rays with met[ray] >= 0.
void add_harmonics(std::span<const std::int32_t> met, std::span<const std::uint32_t> aggregate_of,
                   const float* harmonics, float* sum);

/// Nine sums of harmonics as if the directions had been turned about z, to[lm * stride]: m and -m go as cosine and
/// sine of m times the azimuth, so the pair (Y_l,-m, Y_l,m) turns by m times the angle.
void turn_harmonics(const float* from, const glm::vec2& turn, std::size_t stride, Bands bands, float* to);

} // namespace daylit::radiosity
