#pragma once

// Random numbers by counter, and the maps that carry them and low-discrepancy points to hemispheres, spheres and
// spherical triangles.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/core/orthonormal.h"
#include "scene/core/r2_points.h"

namespace daylit::radiosity {

/// 64-bit mix (Stafford variant 13): decorrelates counters, so that every value is a function of (seed, index) only.
inline std::uint64_t mix_bits(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}
inline double unit_interval(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1p-53; }

inline glm::dvec2 random_shift(std::uint64_t seed) {
  return {unit_interval(mix_bits(seed)), unit_interval(mix_bits(seed + 0x9E3779B97F4A7C15ull))};
}

/// Uniform on the sphere.
inline glm::dvec3 sphere_direction(const glm::dvec2& u) {
  const double z = 1.0 - 2.0 * u.x, r = std::sqrt(std::max(0.0, 1.0 - z * z)), phi = 2.0 * std::numbers::pi * u.y;
  return {r * std::cos(phi), r * std::sin(phi), z};
}

/// k-th of n points of the spherical Fibonacci lattice (Swinbank & Purser 2006), turned by shift.y about z and moved
/// by shift.x within its ring: uniform, and integrates low bands of spherical harmonics far better than random points.
inline glm::dvec3 fibonacci_direction(std::uint32_t k, std::uint32_t n, const glm::dvec2& shift) {
  const double z = 1.0 - 2.0 * (k + 0.25 + 0.5 * shift.x) / n, r = std::sqrt(std::max(0.0, 1.0 - z * z));
  const double turn = k * 0.61803398874989484820 + shift.y, phi = 2.0 * std::numbers::pi * (turn - std::floor(turn));
  return {r * std::cos(phi), r * std::sin(phi), z};
}

/// Solid angle of the spherical triangle of three unit vectors (Van Oosterom & Strackee 1983), sr, positive.
inline double spherical_triangle_sr(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const double volume = std::abs(glm::dot(a, glm::cross(b, c)));
  return 2.0 * std::atan2(volume, 1.0 + glm::dot(a, b) + glm::dot(b, c) + glm::dot(c, a));
}

/// Direction uniform in the solid angle of a spherical triangle (Arvo 1995); corners are unit vectors.
inline glm::dvec3 on_spherical_triangle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                                        const glm::dvec2& u) {
  const glm::dvec3 nab = glm::normalize(glm::cross(a, b)), nac = glm::normalize(glm::cross(a, c));
  const double cos_alpha = std::clamp(glm::dot(nab, nac), -1.0, 1.0), alpha = std::acos(cos_alpha);
  const double area = u.x * spherical_triangle_sr(a, b, c), cos_c = glm::dot(a, b);
  const double s = std::sin(area - alpha), t = std::cos(area - alpha), sin_alpha = std::sin(alpha);
  const double p = t - cos_alpha, q = s + sin_alpha * cos_c;
  const double denominator = (q * s + p * t) * sin_alpha;
  const double numerator = (t * q - s * p) * cos_alpha - q;
  const double cos_b = std::abs(denominator) > 1e-300 ? std::clamp(numerator / denominator, -1.0, 1.0) : 1.0;
  const glm::dvec3 towards_c = c - glm::dot(c, a) * a;
  const double length = glm::length(towards_c);
  const glm::dvec3 c_hat =
      length > 0 ? cos_b * a + std::sqrt(std::max(0.0, 1.0 - cos_b * cos_b)) * (towards_c / length) : a;
  const double z = 1.0 - u.y * (1.0 - glm::dot(c_hat, b));
  const glm::dvec3 off = c_hat - glm::dot(c_hat, b) * b;
  const double off_length = glm::length(off);
  return off_length > 0 ? z * b + std::sqrt(std::max(0.0, 1.0 - z * z)) * (off / off_length) : b;
}

} // namespace daylit::radiosity
