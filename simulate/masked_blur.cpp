#include "simulate/masked_blur.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace daylit {

namespace {

constexpr int kReach = 6;

/// exp(-x^2 / (2 sigma^2)) along one axis; outside the picture is nothing.
Plane blur_along(const Plane& from, int width, int height, int dx, int dy) {
  std::array<double, 2 * kReach + 1> weight{};
  for (int k = -kReach; k <= kReach; ++k)
    weight[static_cast<std::size_t>(k + kReach)] = std::exp(-k * k / (2.0 * kBlur_px * kBlur_px));
  Plane to(from.size(), 0.0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int k = -kReach; k <= kReach; ++k)
        if (const int u = x + k * dx, v = y + k * dy; u >= 0 && u < width && v >= 0 && v < height)
          to[static_cast<std::size_t>(y) * width + x] +=
              weight[static_cast<std::size_t>(k + kReach)] * from[static_cast<std::size_t>(v) * width + u];
  return to;
}

} // namespace

Plane blur_within(Plane value, const Plane& mask, int width, int height) {
  const auto blur = [&](const Plane& p) { return blur_along(blur_along(p, width, height, 1, 0), width, height, 0, 1); };
  for (std::size_t i = 0; i < value.size(); ++i)
    value[i] *= mask[i];
  Plane sum = blur(value);
  const Plane weight = blur(mask);
  for (std::size_t i = 0; i < sum.size(); ++i)
    sum[i] /= std::max(weight[i], 1e-9);
  return sum;
}

} // namespace daylit
