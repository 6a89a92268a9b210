#include "scene/volume/sh_layout.h"

#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

namespace daylit {
namespace {

constexpr double kPi = std::numbers::pi;

Sh9Rgb some_light() {
  Sh9Rgb sh{};
  for (std::size_t k = 0; k < 9; ++k)
    sh[k] = Rgb(1.0f + 0.3f * static_cast<float>(k), 0.5f - 0.2f * static_cast<float>(k * k % 5),
                0.1f * static_cast<float>(k) - 0.4f);
  sh[0] = Rgb(6.0f, 5.0f, 4.0f);
  return sh;
}

/// What each engine's shader makes of the numbers for a normal in its own axes: irradiance / pi.
glm::dvec3 shaded(const std::array<float, 27>& s, const glm::dvec3& n, ShLayout layout) {
  glm::dvec3 result(0.0);
  const double x = n.x, y = n.y, z = n.z;
  for (int c = 0; c < 3; ++c) {
    const auto at = [&](int k) {
      return static_cast<double>(layout == ShLayout::three ? s[static_cast<std::size_t>(3 * k + c)]
                                                           : s[static_cast<std::size_t>(9 * c + k)]);
    };
    if (layout == ShLayout::unity) {
      // unity_SHA = (s3, s1, s2, s0 - s6), unity_SHB = (s4, s5, 3 s6, s7), unity_SHC = s8
      result[c] = at(3) * x + at(1) * y + at(2) * z + at(0) - at(6) + at(4) * x * y + at(5) * y * z +
                  3.0 * at(6) * z * z + at(7) * z * x + at(8) * (x * x - y * y);
    } else if (layout == ShLayout::three) {
      result[c] = at(0) * 0.886227 + 2.0 * 0.511664 * (at(1) * y + at(2) * z + at(3) * x) +
                  2.0 * 0.429043 * (at(4) * x * y + at(5) * y * z + at(7) * x * z) +
                  at(6) * (0.743125 * z * z - 0.247708) + 0.429043 * at(8) * (x * x - y * y);
      result[c] /= kPi;
    } else {
      // Engine's basis times the cosine lobe pi, 2 pi / 3, pi / 4.
      result[c] = 0.282095 * at(0) * kPi + (2 * kPi / 3) * 0.488603 * (-at(1) * y + at(2) * z - at(3) * x) +
                  (kPi / 4) * (1.092548 * (at(4) * x * y - at(5) * y * z - at(7) * x * z) +
                               0.315392 * at(6) * (3 * z * z - 1) + 0.546274 * at(8) * (x * x - y * y));
      result[c] /= kPi;
    }
  }
  return result;
}

TEST(ShLayout, the_shader_of_every_engine_finds_the_irradiance) {
  const Sh9Rgb light = some_light();
  for (const ShLayout layout : {ShLayout::unity, ShLayout::unreal, ShLayout::three})
    for (int k = 0; k < 40; ++k) {
      const double z = 1.0 - 2.0 * (k + 0.5) / 40, a = 2.4 * k, r = std::sqrt(1.0 - z * z);
      const glm::dvec3 n(r * std::cos(a), r * std::sin(a), z);
      const glm::dvec3 expected = glm::dvec3(irradiance(light, glm::vec3(n))) / kPi;
      const glm::dvec3 found = shaded(to_engine(light, layout), engine_axes(n, layout), layout);
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(found[c], expected[c], 2e-5) << static_cast<int>(layout); // constants are rounded to six digits
    }
}

TEST(ShLayout, light_from_above_comes_from_the_engines_up) {
  Sh9Rgb up{};
  up[2] = Rgb(1.0f);                                   // z
  EXPECT_GT(to_engine(up, ShLayout::unity)[1], 0.3f);  // y
  EXPECT_GT(to_engine(up, ShLayout::unreal)[2], 0.9f); // z
  EXPECT_GT(to_engine(up, ShLayout::three)[3], 0.9f);  // y
}

} // namespace
} // namespace daylit
