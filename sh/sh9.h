#pragma once

// The nine real orthonormal spherical harmonics of bands 0..2, closed form: the fast path used per probe, vertex
// and pixel. Index l*l+l+m, no Condon-Shortley phase: Y_1,-1 ~ y, Y_1,0 ~ z, Y_1,1 ~ x.

#include <array>
#include <numbers>

#include <glm/vec3.hpp>

namespace daylit::sh {

/// Y_lm of a unit direction, bands 0..2.
template <class T>
constexpr std::array<T, 9> evaluate9(T x, T y, T z) {
  constexpr T c0 = T(0.28209479177387814347), c1 = T(0.48860251190291992159), c2 = T(1.09254843059207907054),
              c20 = T(0.31539156525252000603), c22 = T(0.54627421529603953527);
  return {c0,
          c1 * y,
          c1 * z,
          c1 * x,
          c2 * x * y,
          c2 * y * z,
          c20 * (T(3) * z * z - T(1)),
          c2 * x * z,
          c22 * (x * x - y * y)};
}

template <class T>
constexpr std::array<T, 9> evaluate9(const glm::vec<3, T>& d) {
  return evaluate9<T>(d.x, d.y, d.z);
}

/// Band factors of the clamped cosine, A_0..A_2 = pi, 2pi/3, pi/4 (Ramamoorthi & Hanrahan 2001, eq. 8).
template <class T>
inline constexpr std::array<T, 3> kClampedCosine = {std::numbers::pi_v<T>, std::numbers::pi_v<T>* T(2) / T(3),
                                                    std::numbers::pi_v<T> / T(4)};

/// A_l expanded to the nine indices.
template <class T>
inline constexpr std::array<T, 9> kClampedCosine9 = {kClampedCosine<T>[0], kClampedCosine<T>[1], kClampedCosine<T>[1],
                                                     kClampedCosine<T>[1], kClampedCosine<T>[2], kClampedCosine<T>[2],
                                                     kClampedCosine<T>[2], kClampedCosine<T>[2], kClampedCosine<T>[2]};

} // namespace daylit::sh
