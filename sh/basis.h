#pragma once

// Real orthonormal spherical harmonics Y_lm, no Condon-Shortley phase, index l*l + l + m:
//   Y_lm = P_l|m|(cos theta) x { sqrt 2 cos m phi (m > 0), 1 (m = 0), sqrt 2 sin |m| phi (m < 0) },
//   P_lm = sqrt((2l + 1) / 4 pi (l - m)! / (l + m)!) x associated Legendre function. Y_1,-1 ~ y, Y_1,0 ~ z, Y_1,1 ~ x.
// Factorials are never formed: recurrences run on the normalised functions, with an exponent carried beside the number
// where sin^m theta is outside the range of the type. Every value is finite for every unit direction and degree to
// kMaxDegree. Error relative to the largest value of a row, sqrt((2l + 1) / 4 pi): about 1e-15 l in double, 1e-7 l in
// float at worst; the measured figures are in docs/sh.md.

#include <array>
#include <cstddef>
#include <span>

#include <glm/vec3.hpp>

#include "sh/error.h"
#include "sh/quadrature.h"
#include "sh/sh9.h"

namespace daylit::sh {

/// Name of the vector instructions in use ("baseline", "avx2", "avx512"), chosen by what the processor has.
const char* instruction_set();

/// How far from 1 the length of a "unit" direction may be; within, the direction is normalised.
inline constexpr double kUnitTolerance = 1e-6;
inline constexpr float kUnitToleranceFloat = 1e-4f;

/// All Y_lm up to `degree` of one direction; `out` has (degree + 1)^2 numbers.
Expected<void> evaluate(int degree, const glm::dvec3& direction, std::span<double> out);
Expected<void> evaluate(int degree, const glm::vec3& direction, std::span<float> out);

/// One order m >= 0, degrees m .. degree: cosine_part[i] = Y_{m+i,m}, sine_part[i] = Y_{m+i,-m} (for m = 0 the sine
/// part is 0). Memory O(degree), where all harmonics of a high degree would not fit.
Expected<void> evaluate_order(int order, int degree, const glm::dvec3& direction, std::span<double> cosine_part,
                              std::span<double> sine_part);

/// evaluate() for many directions given as arrays: index i of direction k goes to out[i * x.size() + k].
Expected<void> evaluate_batch(int degree, std::span<const double> x, std::span<const double> y,
                              std::span<const double> z, std::span<double> out);
Expected<void> evaluate_batch(int degree, std::span<const float> x, std::span<const float> y, std::span<const float> z,
                              std::span<float> out);

/// Bands 0..2 of many unit directions, closed form, at the speed of memory. Plane i starts at out[i * plane_stride],
/// plane_stride >= x.size(); planes that are multiples of 64 bytes apart are written past the caches.
/// Directions are not checked: this is the loop over pixels and vertices.
Expected<void> evaluate9_batch(std::span<const float> x, std::span<const float> y, std::span<const float> z,
                               std::span<float> out, std::size_t plane_stride);
Expected<void> evaluate9_batch(std::span<const double> x, std::span<const double> y, std::span<const double> z,
                               std::span<double> out, std::size_t plane_stride);

/// Bands 0..3 in closed form.
template <class T>
constexpr std::array<T, 16> evaluate16(T x, T y, T z) {
  constexpr T c30 = T(0.37317633259011539141), c31 = T(0.45704579946446573616), c32 = T(1.44530572132027702777),
              c33 = T(0.59004358992664351035), c3m2 = T(2.89061144264055405554);
  const std::array<T, 9> low = evaluate9<T>(x, y, z);
  std::array<T, 16> out{};
  for (std::size_t i = 0; i < 9; ++i)
    out[i] = low[i];
  const T five = T(5) * z * z;
  out[9] = c33 * y * (T(3) * x * x - y * y);
  out[10] = c3m2 * x * y * z;
  out[11] = c31 * y * (five - T(1));
  out[12] = c30 * z * (five - T(3));
  out[13] = c31 * x * (five - T(1));
  out[14] = c32 * z * (x * x - y * y);
  out[15] = c33 * x * (x * x - T(3) * y * y);
  return out;
}

/// Order = number of bands, 1 to 4: the first Order * Order harmonics in closed form.
template <int Order, class T>
constexpr std::array<T, std::size_t(Order* Order)> evaluate_closed(T x, T y, T z) {
  static_assert(Order >= 1 && Order <= 4, "closed forms exist for one to four bands");
  std::array<T, std::size_t(Order * Order)> out{};
  if constexpr (Order <= 3) {
    const auto all = evaluate9<T>(x, y, z);
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = all[i];
  } else {
    out = evaluate16<T>(x, y, z);
  }
  return out;
}

} // namespace daylit::sh
