#include "sh/irradiance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sh/detail/check.h"
#include "sh/zonal.h"

namespace daylit::sh {

Expected<Order3Remainder> order3_remainder(std::span<const double> coefficients, double rest_energy) {
  constexpr const char* where = "order3_remainder";
  constexpr double pi = std::numbers::pi;
  const int degree = int(std::lround(std::sqrt(double(coefficients.size())))) - 1;
  if (degree < 2 || std::size_t(degree + 1) * std::size_t(degree + 1) != coefficients.size())
    return Error{ErrorCode::wrong_count,
                 std::to_string(coefficients.size()) + " coefficients, need (degree + 1)^2 with degree >= 2", where};
  if (const auto ok = detail::check_finite<double>(coefficients, "coefficient", where); !ok)
    return ok.error();
  if (!(rest_energy >= 0.0) || !std::isfinite(rest_energy))
    return Error{ErrorCode::parameter_out_of_range, "rest_energy must not be negative", where};
  const auto bands = clamped_cosine_bands(degree + 2);
  if (!bands)
    return bands.error();
  Order3Remainder r;
  double square = 0.0, kernel_energy = 2.0 * pi / 3.0; // integral of max(0, cos)^2 = sum of A_l^2 (2l + 1) / 4 pi
  for (int l = 0; l <= degree; ++l) {
    const double a = (*bands)[std::size_t(l)], per_order = (2.0 * l + 1.0) / (4.0 * pi);
    kernel_energy -= a * a * per_order;
    if (l < 3)
      continue;
    double band = 0.0;
    for (std::size_t i = std::size_t(l) * std::size_t(l); i < std::size_t(l + 1) * std::size_t(l + 1); ++i)
      band += coefficients[i] * coefficients[i];
    square += a * a * band;
    r.max_bound += std::abs(a) * std::sqrt(per_order * band);
  }
  const double next =
      std::max(std::abs((*bands)[std::size_t(degree) + 1]), std::abs((*bands)[std::size_t(degree) + 2]));
  r.rms = std::sqrt((square + next * next * rest_energy) / (4.0 * pi));
  r.max_bound += std::sqrt(std::max(kernel_energy, 1e-15) * rest_energy);
  r.max_bound_nonnegative = 3.0 / 32.0 * std::sqrt(4.0 * pi) * std::abs(coefficients[0]);
  return r;
}

} // namespace daylit::sh
