#pragma once

// Band 4, in closed form: what a surface under cosine weighting sees next after bands 0..2. The clamped cosine has no
// band 3 (A_3 = 0), so bands 0, 1, 2 and 4 are irradiance to order 4; for light from one direction they leave half of
// what the first three leave (sum of A_l^2 (2l + 1) over the bands above).

#include <array>
#include <numbers>

#include <glm/vec3.hpp>

namespace daylit::sh {

/// Y_4m of a unit direction, index m + 4. Real, orthonormal, no Condon-Shortley phase.
template <class T>
constexpr std::array<T, 9> evaluate_band4(T x, T y, T z) {
  constexpr T c0 = T(0.10578554691520430930), c1 = T(0.66904654355728920834), c2 = T(0.94617469575756008027),
              c3 = T(1.77013076977993044636), c4 = T(2.50334294179670457936);
  const T xx = x * x, yy = y * y, zz = z * z;
  return {c4 * x * y * (xx - yy),
          c3 * y * z * (T(3) * xx - yy),
          c2 * x * y * (T(7) * zz - T(1)),
          c1 * y * z * (T(7) * zz - T(3)),
          c0 * (T(35) * zz * zz - T(30) * zz + T(3)),
          c1 * x * z * (T(7) * zz - T(3)),
          T(0.5) * c2 * (xx - yy) * (T(7) * zz - T(1)),
          c3 * x * z * (xx - T(3) * yy),
          T(0.25) * c4 * (xx * (xx - T(3) * yy) - yy * (T(3) * xx - yy))};
}

template <class T>
constexpr std::array<T, 9> evaluate_band4(const glm::vec<3, T>& d) {
  return evaluate_band4<T>(d.x, d.y, d.z);
}

/// A_4 of the clamped cosine (Ramamoorthi & Hanrahan 2001, eq. 8).
template <class T>
inline constexpr T kClampedCosineBand4 = -std::numbers::pi_v<T> / T(24);

} // namespace daylit::sh
