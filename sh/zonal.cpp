#include "sh/zonal.h"

#include <cmath>
#include <numbers>

#include "sh/detail/check.h"

namespace daylit::sh {
namespace {

Expected<void> check_exponent(double s, const char* where) {
  if (s >= 1.0 && std::isfinite(s))
    return {};
  return Error{ErrorCode::parameter_out_of_range,
               "Phong exponent is " + std::to_string(s) + ", must be a finite number of at least 1", where};
}

} // namespace

Expected<std::vector<double>> phong_mean_bands(double exponent, int degree) {
  if (const auto ok = check_exponent(exponent, "phong_bands"); !ok)
    return ok.error();
  if (const auto ok = detail::check_degree(degree, "phong_bands"); !ok)
    return ok.error();
  const double s = exponent;
  std::vector<double> a(std::size_t(degree) + 1, 1.0);
  if (degree >= 1)
    a[1] = (s + 1.0) / (s + 2.0);
  for (std::size_t l = 2; l < a.size(); ++l)
    a[l] = a[l - 2] * ((s - (double(l) - 2.0)) / (s + (double(l) + 1.0)));
  return a;
}

Expected<std::vector<double>> phong_bands(double exponent, int degree) {
  auto a = phong_mean_bands(exponent, degree);
  if (a)
    for (double& value : *a)
      value *= 2.0 * std::numbers::pi / (exponent + 1.0);
  return a;
}

Expected<std::vector<double>> clamped_cosine_bands(int degree) { return phong_bands(1.0, degree); }

Expected<int> phong_degree(double exponent, double tolerance) {
  if (const auto ok = check_exponent(exponent, "phong_degree"); !ok)
    return ok.error();
  if (!(tolerance > 0.0 && tolerance < 1.0))
    return Error{ErrorCode::parameter_out_of_range, "tolerance must lie between 0 and 1", "phong_degree"};
  // |A_l| falls within each parity, so two successive small factors end the search.
  double before = 1.0, now = (exponent + 1.0) / (exponent + 2.0);
  for (int l = 2; l <= kMaxDegree; ++l) {
    const double next = before * ((exponent - (l - 2.0)) / (exponent + (l + 1.0)));
    if (std::abs(now) < tolerance && std::abs(next) < tolerance)
      return l - 2;
    before = now;
    now = next;
  }
  return Error{ErrorCode::degree_out_of_range,
               "exponent " + std::to_string(exponent) + " needs a degree above " + std::to_string(kMaxDegree),
               "phong_degree"};
}

Expected<void> convolve(std::span<const double> bands, int channels, std::span<double> coefficients) {
  const std::size_t degrees = bands.size();
  if (const auto ok = detail::check_coefficients(coefficients.size(), int(degrees) - 1, channels, "convolve"); !ok)
    return ok;
  for (std::size_t l = 0; l < degrees; ++l)
    for (std::size_t i = l * l * std::size_t(channels); i < (l + 1) * (l + 1) * std::size_t(channels); ++i)
      coefficients[i] *= bands[l];
  return {};
}

} // namespace daylit::sh
