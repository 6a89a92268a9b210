// What changes from frame to frame must be the scene, not the sensor; what changes in the scene must show at once.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <glm/geometric.hpp>

#include "runtime/sky/steady_sun.h"
#include "scene/sky/sky_image.h"

namespace daylit {
namespace {

constexpr int kWidth = 256, kHeight = 128;

/// A sky of radiance 1 with a sun of four unequal pixels, each pixel off by 1 %.
SkyImage noisy_sky(unsigned seed, float sun_radiance) {
  RgbImage image(kWidth, kHeight, Rgb(1.0f));
  for (int k = 0; k < 4; ++k)
    image.at(100 + k % 2, 40 + k / 2) = Rgb(sun_radiance * (k == 0 ? 1.0f : 0.4f));
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(1.0f, 0.01f);
  for (Rgb& c : image.texels)
    for (int i = 0; i < 3; ++i)
      c[i] *= noise(random);
  const auto geometry = SkyGeometry::make(kWidth, kHeight, EquirectProjection{});
  return *SkyImage::make(std::move(image), *geometry, {});
}

std::vector<glm::vec3> directions_of(const SkyImage& sky) {
  std::vector<glm::vec3> directions;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      directions.emplace_back(*sky.direction({x, y}));
  return directions;
}

/// Energy of the sun in each of the frames, as measured and as kept steady.
struct Energies {
  std::vector<double> measured, steady;
};
Energies watch(const std::vector<float>& radiance) {
  SteadySun steady;
  Energies e;
  for (std::size_t k = 0; k < radiance.size(); ++k) {
    const SkyImage sky = noisy_sky(static_cast<unsigned>(k + 1), radiance[k]);
    const auto sun = find_sun(sky, directions_of(sky));
    EXPECT_TRUE(sun);
    e.measured.push_back(static_cast<double>(sun->normal_irradiance.g));
    e.steady.push_back(static_cast<double>(steady.update(sky, sun)->normal_irradiance.g));
  }
  return e;
}

double relative_deviation(const std::vector<double>& v) {
  double sum = 0, square = 0;
  for (const double x : v) {
    sum += x;
    square += x * x;
  }
  const double n = static_cast<double>(v.size()), mean = sum / n;
  return std::sqrt(std::max(square / n - mean * mean, 0.0)) / mean;
}

TEST(SteadySun, noise_of_its_few_pixels_averages_out) {
  const Energies e = watch(std::vector<float>(40, 5000.0f));
  // Weights 1, 0.4, 0.4, 0.4 of 2.2: 1 % x sqrt(1.48) / 2.2 = 0.55 %.
  EXPECT_NEAR(relative_deviation(e.measured), 0.0055, 0.002);
  // The mean over frames so far: 0.55 % x sqrt(H(40) / 40), H the harmonic number.
  EXPECT_LT(relative_deviation(e.steady), 0.0025);
}

TEST(SteadySun, a_cloud_dims_the_sun_in_the_very_next_frame) {
  std::vector<float> radiance(30, 5000.0f);
  for (std::size_t k = 15; k < radiance.size(); ++k)
    radiance[k] = 4500.0f;
  const Energies e = watch(radiance);
  EXPECT_EQ(e.steady[15], e.measured[15]) << "the frame that shows the step is taken as it is";
  EXPECT_NEAR(e.steady[29] / e.steady[14], 0.9, 0.005);
}

TEST(SteadySun, a_slow_drift_is_followed_within_the_noise) {
  std::vector<float> radiance;
  for (int k = 0; k < 60; ++k)
    radiance.push_back(5000.0f * (1.0f - 0.002f * static_cast<float>(k)));
  const Energies e = watch(radiance);
  for (std::size_t k = 0; k < e.steady.size(); ++k) {
    const double truth = e.measured[0] * static_cast<double>(radiance[k]) / 5000.0;
    EXPECT_NEAR(e.steady[k] / truth, 1.0, 0.03) << k;
  }
}

} // namespace
} // namespace daylit
