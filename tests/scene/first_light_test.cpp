// The sky's light on surfaces: blocks of half floats against sums in double.

#include <random>

#include <Imath/half.h>
#include <gtest/gtest.h>

#include "scene/volume/first_light.h"
#include "tests/scene/plain_compact.h"

namespace daylit {
namespace {

constexpr std::size_t kRegions = 203; // the last block is not whole

/// Rows of 0 to 20 blocks; a third of the weights are 0.
FirstLight random_light(std::size_t rows, std::uint32_t colours = 1) {
  std::mt19937 random(18);
  FirstLight light;
  light.colours = colours;
  light.first_block = {0};
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::uint16_t b = 0; 8u * b < kRegions; ++b) {
      if (random() % (1 + row % 4) != 0 || row % 7 == 3)
        continue;
      light.block.push_back(b);
      for (std::size_t k = 0; k < 8; ++k)
        light.weight.push_back(8u * b + k < kRegions && random() % 3 != 0
                                   ? imath_float_to_half(static_cast<float>(random() % 1000) / 1000.0f)
                                   : std::uint16_t{0});
    }
    light.scale.push_back(0.5f + static_cast<float>(row));
    light.first_block.push_back(static_cast<std::uint32_t>(light.block.size()));
  }
  return light;
}

std::vector<Rgb> random_sky() {
  std::mt19937 random(19);
  std::vector<Rgb> sky(kRegions);
  for (Rgb& c : sky)
    c = {static_cast<float>(random() % 100), static_cast<float>(random() % 1000), 1e-3f};
  return sky;
}

TEST(FirstLight, sources_receive_the_sum_of_weights_times_radiances) {
  const std::vector<Rgb> sky = random_sky();
  for (const std::uint32_t colours : {1u, 3u}) { // clear and tinted panes
    const FirstLight light = random_light(40 * colours, colours);
    ASSERT_TRUE(check_first_light(light, kRegions));
    const std::vector<Rgb> fast = irradiance_of_sources(light, sky);
    const std::vector<glm::dvec3> plain = test::plain_irradiance(light, sky);
    ASSERT_EQ(fast.size(), 40u);
    for (std::size_t s = 0; s < fast.size(); ++s)
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(double(fast[s][c]), plain[s][c], 1e-6 * plain[s][c]) << s;
  }
}

TEST(FirstLight, regions_with_a_weight_are_lit_and_no_others) {
  FirstLight light = random_light(0);
  light.scale = {1.0f, 2.0f};
  light.first_block = {0, 2, 3};
  light.block = {1, 25, 1};
  light.weight.assign(24, 0);
  light.weight[3] = light.weight[10] = light.weight[19] = 0x3c00;
  light.weight[20] = 0x8000; // -0 lights nothing
  ASSERT_TRUE(check_first_light(light, kRegions));
  const std::vector<std::uint8_t> lit = lit_regions(light, kRegions);
  for (std::size_t r = 0; r < kRegions; ++r)
    EXPECT_EQ(lit[r], r == 11 || r == 202 ? 1 : 0) << r;
}

TEST(FirstLight, what_is_damaged_is_refused) {
  const auto refused = [](const auto& damage) {
    FirstLight light = random_light(8);
    damage(light);
    return !check_first_light(light, kRegions);
  };
  EXPECT_FALSE(refused([](FirstLight&) {}));
  EXPECT_TRUE(refused([](FirstLight& l) { l.block[1] = l.block[0]; }));
  EXPECT_TRUE(refused([](FirstLight& l) { l.block[l.first_block[1] - 1] = 26; }));
  EXPECT_TRUE(refused([](FirstLight& l) { l.weight[5] = 0x7c00; }));
  EXPECT_TRUE(refused([](FirstLight& l) { l.weight[8 * l.first_block[1] - 1] = 0x3c00; })); // beyond the last region
  EXPECT_TRUE(refused([](FirstLight& l) { l.first_block[2] = l.first_block[1] - 1; }));
  EXPECT_TRUE(refused([](FirstLight& l) { l.weight.pop_back(); }));
  EXPECT_TRUE(refused([](FirstLight& l) { l.scale.pop_back(); }));
  EXPECT_TRUE(refused([](FirstLight& l) { l.colours = 3; })); // eight rows are not three to a source
  EXPECT_TRUE(refused([](FirstLight& l) { l.colours = 0; }));
  EXPECT_TRUE(refused([](FirstLight& l) { l.scale[0] = std::numeric_limits<float>::infinity(); }));
}

} // namespace
} // namespace daylit
