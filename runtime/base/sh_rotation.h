#pragma once

#include <array>
#include <cstddef>

#include <glm/mat3x3.hpp>

#include "sh/sh9.h"

namespace daylit {

/// Coefficients of f(R^-1 w) given those of f(w): the function turned by R. Exact for bands 0..2: band 1 is a vector,
/// band 2 a symmetric traceless 3 x 3 tensor Q with f_2(w) = w' Q w, turned to R Q R'.
/// `T` is a scalar or a colour; R must be a rotation.
template <class T>
std::array<T, 9> rotate9(const glm::mat3& r, const std::array<T, 9>& f) {
  // Y_2m = k xy, k yz, c (3 z^2 - 1), k xz, h (x^2 - y^2): with 3 z^2 - 1 = 2 z^2 - x^2 - y^2 on the unit sphere.
  constexpr float k = 1.09254843059207907f, c = 0.315391565252520006f, h = 0.546274215296039535f;
  const T q[3][3] = {{f[8] * h - f[6] * c, f[4] * (0.5f * k), f[7] * (0.5f * k)},
                     {f[4] * (0.5f * k), f[6] * -c - f[8] * h, f[5] * (0.5f * k)},
                     {f[7] * (0.5f * k), f[5] * (0.5f * k), f[6] * (2.0f * c)}};
  T turned[3][3]; // glm is column-major: R_ij = r[j][i]
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) {
      T sum{};
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b)
          sum += q[a][b] * (r[a][i] * r[b][j]);
      turned[i][j] = sum;
    }
  const T v[3] = {f[3], f[1], f[2]};
  const auto row = [&](int i) { return v[0] * r[0][i] + v[1] * r[1][i] + v[2] * r[2][i]; };
  return {f[0],
          row(1),
          row(2),
          row(0),
          turned[0][1] * (2.0f / k),
          turned[1][2] * (2.0f / k),
          turned[2][2] * (0.5f / c),
          turned[0][2] * (2.0f / k),
          (turned[0][0] - turned[1][1]) * (0.5f / h)};
}

/// rotate9() for many vectors and one rotation.
class Rotation9 {
public:
  explicit Rotation9(const glm::mat3& r) {
    for (std::size_t j = 0; j < 9; ++j) {
      std::array<float, 9> unit{};
      unit[j] = 1.0f;
      column_[j] = rotate9<float>(r, unit);
    }
  }
  std::array<float, 9> operator()(const std::array<float, 9>& f) const {
    std::array<float, 9> turned{f[0]};
    for (std::size_t j = 1; j < 4; ++j)
      for (std::size_t i = 1; i < 4; ++i)
        turned[i] += column_[j][i] * f[j];
    for (std::size_t j = 4; j < 9; ++j)
      for (std::size_t i = 4; i < 9; ++i)
        turned[i] += column_[j][i] * f[j];
    return turned;
  }

private:
  std::array<std::array<float, 9>, 9> column_; ///< what each coefficient becomes
};

} // namespace daylit
