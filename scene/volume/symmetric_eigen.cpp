#include "scene/volume/symmetric_eigen.h"

#include <cmath>

namespace daylit::detail {

namespace {

/// Rotates rows p and q.
void rotate_rows(std::vector<double>& m, std::size_t n, std::size_t p, std::size_t q, double c, double s) {
  for (std::size_t k = 0; k < n; ++k) {
    const double x = m[p * n + k], y = m[q * n + k];
    m[p * n + k] = c * x - s * y;
    m[q * n + k] = s * x + c * y;
  }
}

void rotate_columns(std::vector<double>& m, std::size_t n, std::size_t p, std::size_t q, double c, double s) {
  for (std::size_t k = 0; k < n; ++k) {
    const double x = m[k * n + p], y = m[k * n + q];
    m[k * n + p] = c * x - s * y;
    m[k * n + q] = s * x + c * y;
  }
}

} // namespace

std::vector<double> symmetric_eigen(std::vector<double> a, std::size_t n, std::vector<double>& values) {
  constexpr int kMostSweeps = 30;
  constexpr double kSmall = 1e-12;
  std::vector<double> vectors(n * n, 0.0);
  for (std::size_t k = 0; k < n; ++k)
    vectors[k * n + k] = 1.0;
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    bool done = true;
    for (std::size_t p = 0; p + 1 < n; ++p)
      for (std::size_t q = p + 1; q < n; ++q) {
        const double off = a[p * n + q], pp = a[p * n + p], qq = a[q * n + q];
        if (!(std::abs(off) > kSmall * std::sqrt(std::abs(pp * qq)) && std::abs(off) > 1e-300))
          continue;
        done = false;
        const double theta = (qq - pp) / (2 * off);
        const double t = (theta < 0 ? -1.0 : 1.0) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        rotate_rows(a, n, p, q, c, s);
        rotate_columns(a, n, p, q, c, s);
        rotate_rows(vectors, n, p, q, c, s);
      }
    if (done)
      break;
  }
  values.resize(n);
  for (std::size_t k = 0; k < n; ++k)
    values[k] = a[k * n + k];
  return vectors;
}

} // namespace daylit::detail
