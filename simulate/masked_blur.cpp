#include "simulate/masked_blur.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace daylit {

namespace {

constexpr int kReach = 6;

/// exp(-power x^2 / (2 sigma^2)) along one axis; outside the picture is nothing.
Plane blur_along(const Plane& from, int width, int height, int dx, int dy, double power) {
  std::array<double, 2 * kReach + 1> weight{};
  for (int k = -kReach; k <= kReach; ++k)
    weight[static_cast<std::size_t>(k + kReach)] = std::exp(-power * k * k / (2.0 * kBlur_px * kBlur_px));
  Plane to(from.size(), 0.0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int k = -kReach; k <= kReach; ++k)
        if (const int u = x + k * dx, v = y + k * dy; u >= 0 && u < width && v >= 0 && v < height)
          to[static_cast<std::size_t>(y) * width + x] +=
              weight[static_cast<std::size_t>(k + kReach)] * from[static_cast<std::size_t>(v) * width + u];
  return to;
}

Plane blur(const Plane& from, int width, int height, double power = 1.0) {
  return blur_along(blur_along(from, width, height, 1, 0, power), width, height, 0, 1, power);
}

} // namespace

Plane blur_within(Plane value, const Plane& mask, int width, int height) {
  for (std::size_t i = 0; i < value.size(); ++i)
    value[i] *= mask[i];
  Plane sum = blur(value, width, height);
  const Plane weight = blur(mask, width, height);
  for (std::size_t i = 0; i < sum.size(); ++i)
    sum[i] /= std::max(weight[i], 1e-9);
  return sum;
}

Plane blurred_error(Plane standard_error, const Plane& mask, int width, int height) {
  for (std::size_t i = 0; i < standard_error.size(); ++i)
    standard_error[i] = mask[i] * mask[i] * standard_error[i] * standard_error[i];
  Plane sum = blur(standard_error, width, height, 2.0);
  const Plane weight = blur(mask, width, height);
  for (std::size_t i = 0; i < sum.size(); ++i)
    sum[i] = std::sqrt(sum[i]) / std::max(weight[i], 1e-9);
  return sum;
}

} // namespace daylit
