#pragma once

// Argument checks shared by the public functions of sh.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>

#include "sh/error.h"
#include "sh/quadrature.h"

namespace daylit::sh::detail {

inline Expected<void> check_degree(int degree, const char* where, int most = kMaxDegree) {
  if (degree >= 0 && degree <= most)
    return {};
  return Error{ErrorCode::degree_out_of_range,
               "degree is " + std::to_string(degree) + ", must be 0 to " + std::to_string(most), where};
}

inline Expected<void> check_count(std::size_t count, std::size_t needed, const char* name, const char* where) {
  if (count == needed)
    return {};
  return Error{ErrorCode::wrong_count,
               "wrong number of " + std::string(name) + ": " + std::to_string(count) + ", needed " +
                   std::to_string(needed),
               where};
}

/// (degree + 1)^2 coefficients in each of `channels` channels, at least one.
inline Expected<void> check_coefficients(std::size_t count, int degree, int channels, const char* where) {
  if (channels < 1)
    return Error{ErrorCode::parameter_out_of_range, "channels must be at least 1", where};
  return check_count(count, std::size_t(degree + 1) * std::size_t(degree + 1) * std::size_t(channels), "coefficients",
                     where);
}

/// Index of the first number that is NaN or infinite.
template <class T>
Expected<void> check_finite(std::span<const T> values, const char* name, const char* where) {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i]))
      return Error{ErrorCode::not_finite, std::string(name) + " " + std::to_string(i) + " is not a finite number",
                   where};
  return {};
}

/// Power of two that brings `largest` near 1 when its products could leave the range of double, else 1.
inline double safe_scale(double largest) {
  if (largest == 0.0 || (largest > 0x1p-300 && largest < 0x1p300))
    return 1.0;
  return std::ldexp(1.0, -std::max(-1020, std::min(1020, std::ilogb(largest))));
}

} // namespace daylit::sh::detail
