#include "simulate/sensor_picture.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "scene/core/parallel.h"

namespace daylit {

namespace {

std::vector<float> gaussian(double sigma) {
  const int reach = static_cast<int>(std::ceil(3 * sigma));
  std::vector<float> kernel;
  double total = 0;
  for (int i = -reach; i <= reach; ++i) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma))));
    total += static_cast<double>(kernel.back());
  }
  for (float& w : kernel)
    w /= static_cast<float>(total);
  return kernel;
}

/// Sum over the kernel along x (step 1, 0) or y (0, 1); the border is continued.
RgbImage convolved(const RgbImage& in, const std::vector<float>& kernel, int dx, int dy) {
  RgbImage out(in.width, in.height);
  const int reach = static_cast<int>(kernel.size() / 2);
  parallel_for(0, in.height, [&](int y) {
    for (int x = 0; x < in.width; ++x) {
      Rgb sum(0.0f);
      for (int i = -reach; i <= reach; ++i)
        sum += kernel[static_cast<std::size_t>(i + reach)] *
               in.at(std::clamp(x + i * dx, 0, in.width - 1), std::clamp(y + i * dy, 0, in.height - 1));
      out.at(x, y) = sum;
    }
  });
  return out;
}

} // namespace

void blur(RgbImage& light, double sigma_px) {
  if (!(sigma_px > 0))
    return;
  const std::vector<float> kernel = gaussian(sigma_px);
  light = convolved(convolved(light, kernel, 1, 0), kernel, 0, 1);
}

void add_noise(RgbImage& light, const CameraNoise& noise, std::uint32_t seed) {
  if (!noise.any())
    return;
  parallel_for(0, light.height, [&](int y) {
    std::seed_seq key{seed, static_cast<std::uint32_t>(y)};
    std::mt19937 random(key);
    std::normal_distribution<double> normal;
    for (int x = 0; x < light.width; ++x)
      for (int c = 0; c < 3; ++c) {
        float& v = light.at(x, y)[c];
        v += static_cast<float>(std::sqrt(noise.variance(static_cast<double>(v))) * normal(random));
      }
  });
}

} // namespace daylit
