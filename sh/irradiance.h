#pragma once

// Irradiance from nine coefficients (Ramamoorthi & Hanrahan 2001), and what they leave out.

#include <array>
#include <span>

#include <glm/vec3.hpp>

#include "sh/error.h"
#include "sh/sh9.h"

namespace daylit::sh {

/// E(n) = sum of A_l L_lm Y_lm(n) over l <= 2, in the unit of the radiance times sr. `n` is a unit vector.
template <class T>
constexpr T irradiance9(const std::array<T, 9>& radiance, const glm::vec<3, T>& n) {
  const std::array<T, 9> y = evaluate9<T>(n);
  T sum = T(0);
  for (std::size_t i = 0; i < 9; ++i)
    sum += kClampedCosine9<T>[i] * radiance[i] * y[i];
  return sum;
}

/// |E - E_3| where E_3 uses nine coefficients, for one given radiance.
struct Order3Remainder {
  double rms = 0.0;                 ///< root mean square over all normals; exact when rest_energy is 0 (Parseval)
  double max_bound = 0.0;           ///< no normal is off by more: Cauchy-Schwarz band by band
  double max_bound_nonnegative = 0; ///< 3/32 of the integral of L: holds for every L >= 0, reached by a point light
                                    ///< at its terminator
  double max() const { return max_bound < max_bound_nonnegative ? max_bound : max_bound_nonnegative; }
};

/// `coefficients`: (degree + 1)^2 of the radiance, degree >= 2, one channel. `rest_energy`: integral of the squared
/// part of the radiance above `degree` (0 when the series is complete); it enters both bounds.
Expected<Order3Remainder> order3_remainder(std::span<const double> coefficients, double rest_energy = 0.0);

} // namespace daylit::sh
