#pragma once

// Shared by the tests of sh: reproducible random numbers, error norms, and Legendre functions in long double.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <span>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

namespace daylit::sh::test {

inline std::vector<double> random_numbers(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<double> out(count);
  for (double& v : out)
    v = uniform(engine);
  return out;
}

inline glm::dvec3 random_direction(std::mt19937_64& engine) {
  std::normal_distribution<double> normal;
  return glm::normalize(glm::dvec3(normal(engine), normal(engine), normal(engine)));
}

/// Rodrigues' formula: turn by `angle` about the unit vector `a`.
inline glm::dmat3 turn(const glm::dvec3& a, double angle) {
  const double c = std::cos(angle), s = std::sin(angle), t = 1.0 - c;
  return {{c + t * a.x * a.x, t * a.x * a.y + s * a.z, t * a.x * a.z - s * a.y},
          {t * a.x * a.y - s * a.z, c + t * a.y * a.y, t * a.y * a.z + s * a.x},
          {t * a.x * a.z + s * a.y, t * a.y * a.z - s * a.x, c + t * a.z * a.z}};
}

inline double max_difference(std::span<const double> a, std::span<const double> b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    most = std::isnan(a[i] - b[i]) ? 1e300 : std::max(most, std::abs(a[i] - b[i]));
  return most;
}

/// Orthonormal P_lm, degrees m .. degree, by the plain three-term recurrence in long double. Its exponent range
/// (1e-4932) holds sin^m theta wherever P_lm is not negligible for l <= 10,000. Cosine and sine are given separately,
/// so that nothing is lost at the poles.
inline std::vector<long double> legendre_reference(int m, int degree, long double cosine, long double sine) {
  using Wide = long double;
  Wide sectoral = 0.5L / std::sqrt(std::numbers::pi_v<Wide>);
  for (int k = 1; k <= m; ++k)
    sectoral *= sine * std::sqrt((2.0L * k + 1.0L) / (2.0L * k));
  std::vector<Wide> p{sectoral};
  const auto a = [m](Wide l) { return std::sqrt((4 * l * l - 1) / ((l - m) * (l + m))); };
  for (int l = m + 1; l <= degree; ++l) {
    const std::size_t i = p.size();
    p.push_back(i == 1 ? a(l) * cosine * p[0] : a(l) * (cosine * p[i - 1] - p[i - 2] / a(l - 1)));
  }
  return p;
}

inline double row_maximum(int l) { return std::sqrt((2.0 * l + 1.0) / (4.0 * std::numbers::pi)); }

} // namespace daylit::sh::test
