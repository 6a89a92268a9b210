// Brackets of a simulated sky with a sun and clouds that move from frame to frame.

#include <cmath>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "capture/hdr/bracket.h"
#include "capture/hdr/bracket_cycle.h"
#include "scene/lens/lens.h"

namespace daylit {
namespace {

constexpr int kSide = 128;
constexpr double kSun = 0.8 * 4096 * 64; ///< radiance of the sun's disc; the sky's is about 1
constexpr double kShortest = 1.0 / (4096 * 64);
const std::vector<double> kTimes{kShortest, 64 * kShortest, 4096 * kShortest};

struct SimulatedSky {
  LensModel lens = ideal_fisheye(kSide, kSide, 3.14159);
  double sun_speed_px = 0.0, cloud_speed_px = 0.3;
  bool cloud_before_sun = false;

  glm::dvec2 sun_px(double frame) const { return {80.3 + sun_speed_px * frame, 52.6}; }
  /// 0 (clear) to 1.
  double cloud(const glm::dvec2& p, double frame) const {
    const double x = p.x - cloud_speed_px * frame, y = p.y;
    const double sum =
        std::sin(0.11 * x + 0.05 * y) + std::sin(0.07 * y - 0.045 * x + 1.0) + std::sin(0.19 * x - 0.13 * y);
    return std::clamp(0.5 * sum, 0.0, 1.0);
  }
  /// As one HDR frame would show it.
  RgbImage radiance(double frame) const {
    RgbImage picture(kSide, kSide);
    const glm::dvec2 sun = sun_px(frame);
    const bool covered = cloud_before_sun && static_cast<int>(frame / 4) % 2 == 1;
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) {
        const glm::dvec2 p(x, y);
        if (!lens.covers(p))
          continue;
        const double c = cloud(p, frame), glow = 30.0 * std::exp(-0.5 * glm::distance(p, sun));
        const double cover = std::max(0.0, 1.0 - std::abs(x - sun.x)) * std::max(0.0, 1.0 - std::abs(y - sun.y));
        const glm::dvec3 sky = (1.0 - c) * glm::dvec3(0.5, 0.8, 1.4) + c * glm::dvec3(2.4, 2.4, 2.5) + glow;
        picture.at(x, y) = Rgb(sky) + static_cast<float>((covered ? 1e-4 : 1.0) * kSun * cover);
      }
    return picture;
  }
};

/// 16 bits, read noise of 0.7 codes, full well of 60,000 electrons.
RgbImage exposed(const RgbImage& radiance, double time, std::mt19937& random) {
  std::normal_distribution<double> normal;
  RgbImage code = radiance;
  for (Rgb& texel : code.texels)
    for (int c = 0; c < 3; ++c) {
      const double v = static_cast<double>(texel[c]) * time;
      const double noisy = v + normal(random) * std::sqrt(v / 60000 + 1e-10);
      texel[c] = static_cast<float>(std::round(65535 * std::clamp(noisy, 0.0, 1.0)) / 65535);
    }
  return code;
}

glm::dvec3 irradiance(const RgbImage& radiance, const LensModel& lens) {
  glm::dvec3 sum(0.0);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      if (const auto d = lens.unproject({x, y}))
        sum += glm::dvec3(radiance.at(x, y)) * d->z * lens.solid_angle_density({x, y});
  return sum;
}

std::size_t suns(const RgbImage& radiance) {
  std::size_t count = 0;
  for (const Rgb& texel : radiance.texels)
    count += static_cast<double>(texel.g) > 0.05 * kSun ? 1 : 0;
  return count;
}

MergeSettings settings16() { return {ResponseCurve::linear(), usual_noise(16)}; }

/// Runs frames whose exposure takes effect `delay(frame)` frames after it was asked for; the worst relative error of
/// the irradiance beside the HDR frame at the time of the shortest exposure.
template <class Delay>
double worst_irradiance_error(const SimulatedSky& sky, const Delay& delay, int frames, unsigned seed) {
  std::mt19937 random(seed);
  auto cycle = BracketCycle::create(kTimes, settings16());
  EXPECT_TRUE(cycle);
  double worst = 0;
  int merges = 0;
  for (int frame = 0; frame < frames; ++frame) {
    const double time = kTimes[static_cast<std::size_t>(std::max(frame - delay(frame), 0)) % 3];
    const auto found = cycle->add(exposed(sky.radiance(frame), time, random), frame);
    EXPECT_TRUE(found);
    if (*found) {
      EXPECT_DOUBLE_EQ(**found, time) << "frame " << frame;
    }
    const auto merged = cycle->merged();
    if (!merged)
      continue;
    ++merges;
    const RgbImage truth = sky.radiance(static_cast<double>(merged->time_ns));
    const glm::dvec3 e = irradiance(merged->bracket.radiance, sky.lens), t = irradiance(truth, sky.lens);
    for (int c = 0; c < 3; ++c)
      worst = std::max(worst, std::abs(e[c] / t[c] - 1.0));
    EXPECT_EQ(suns(merged->bracket.radiance), suns(truth)) << "ghost sun in frame " << frame;
  }
  EXPECT_GT(merges, frames / 3) << "learning takes two cycles";
  return worst;
}

TEST(BracketCycle, exposures_that_take_effect_late_are_learned_from_the_frames) {
  for (int late = 0; late <= 3; ++late)
    EXPECT_LT(worst_irradiance_error(
                  {}, [&](int) { return late; }, 15, 7),
              0.02)
        << late;
}

TEST(BracketCycle, a_delay_that_changes_is_followed) {
  const int delays[] = {0, 2, 3, 1, 1, 3, 0, 2, 0, 1, 3, 3, 2, 0, 1, 2};
  EXPECT_LT(worst_irradiance_error(
                {}, [&](int f) { return delays[f % 16]; }, 24, 3),
            0.02);
}

TEST(BracketCycle, a_moving_sun_stands_once_in_the_result) {
  SimulatedSky sky;
  sky.sun_speed_px = 1.7;
  EXPECT_LT(worst_irradiance_error(
                sky, [](int) { return 1; }, 15, 11),
            0.02);
}

TEST(BracketCycle, a_sun_that_a_cloud_covers_between_exposures_is_as_the_shortest_saw_it) {
  SimulatedSky sky;
  sky.cloud_before_sun = true;
  EXPECT_LT(worst_irradiance_error(
                sky, [](int) { return 2; }, 24, 5),
            0.02);
}

TEST(BracketCycle, a_frame_that_fits_no_exposure_is_not_used) {
  std::mt19937 random(1);
  auto cycle = BracketCycle::create(kTimes, settings16());
  const SimulatedSky sky;
  for (int frame = 0; frame < 6; ++frame)
    ASSERT_TRUE(cycle->add(exposed(sky.radiance(0), kTimes[static_cast<std::size_t>(frame) % 3], random), frame));
  const auto found = cycle->add(exposed(sky.radiance(0), 8 * kTimes[1], random), 6);
  ASSERT_TRUE(found);
  EXPECT_FALSE(*found);
  EXPECT_EQ(cycle->report().unknown, 1u);
}

TEST(BracketCycle, a_frame_of_an_older_setting_at_the_start_does_not_mislead) {
  std::mt19937 random(1);
  auto cycle = BracketCycle::create(kTimes, settings16());
  const SimulatedSky sky;
  const double others[] = {9 * kTimes[1], kTimes[1] / 9};
  for (int frame = 0; frame < 9; ++frame) {
    const double time = frame < 2 ? others[frame] : kTimes[static_cast<std::size_t>(frame) % 3];
    const auto found = cycle->add(exposed(sky.radiance(frame), time, random), frame);
    ASSERT_TRUE(found);
    if (*found) {
      EXPECT_DOUBLE_EQ(**found, time);
    }
  }
  EXPECT_TRUE(cycle->merged());
}

TEST(BracketCycle, a_camera_that_says_its_exposure_with_the_frame_is_believed) {
  std::mt19937 random(1);
  auto cycle = BracketCycle::create(kTimes, settings16());
  const SimulatedSky sky;
  for (int frame = 0; frame < 3; ++frame) {
    const double time = kTimes[static_cast<std::size_t>(2 - frame)];
    const auto found = cycle->add(exposed(sky.radiance(frame), time, random), frame, 1.01 * time);
    ASSERT_TRUE(found && *found);
    EXPECT_DOUBLE_EQ(**found, time);
  }
  EXPECT_TRUE(cycle->merged());
  EXPECT_FALSE(*cycle->add(exposed(sky.radiance(3), 1.0, random), 3, 3 * kTimes[1]));
}

TEST(BracketCycle, exposures_of_another_moment_are_not_merged) {
  std::mt19937 random(1);
  auto cycle = BracketCycle::create(kTimes, settings16());
  const SimulatedSky sky;
  const auto add = [&](int k, double seconds) {
    const double time = kTimes[static_cast<std::size_t>(k) % 3];
    EXPECT_TRUE(cycle->add(exposed(sky.radiance(0), time, random), static_cast<std::int64_t>(1e9 * seconds)));
  };
  for (int frame = 0; frame < 6; ++frame)
    add(frame, 0.1 * frame);
  EXPECT_TRUE(cycle->merged());
  add(0, 60); // nobody looked for a minute
  EXPECT_FALSE(cycle->merged());
  add(1, 60.1), add(2, 60.2), add(3, 60.3);
  EXPECT_TRUE(cycle->merged());
}

TEST(BracketCycle, one_exposure_is_no_bracket) {
  EXPECT_FALSE(BracketCycle::create({1.0}, settings16()));
  EXPECT_FALSE(BracketCycle::create({1.0, 1.5}, settings16()));
  EXPECT_FALSE(BracketCycle::create({1.0, NAN}, settings16()));
}

TEST(BracketMerger, a_sun_beyond_the_shortest_exposure_is_counted) {
  std::mt19937 random(1);
  const SimulatedSky sky;
  BracketMerger merger(kSide, kSide, settings16());
  for (const double time : {4 * kTimes[0], 4 * kTimes[1]})
    ASSERT_TRUE(merger.add(exposed(sky.radiance(0), time, random), time));
  const MergedBracket merged = merger.result();
  EXPECT_GE(merged.over_range, 1u);
  EXPECT_LE(merged.over_range, 4u);
  EXPECT_FALSE(merger.add(exposed(sky.radiance(0), 1.0, random), kTimes[0])) << "shorter than the one before";
  EXPECT_FALSE(merger.add(RgbImage(3, 3), 1.0));
}

TEST(BracketMerger, noise_falls_and_the_mean_stays) {
  std::mt19937 random(2);
  const RgbImage grey(kSide, kSide, Rgb(0.5f, 0.2f, 0.02f));
  BracketMerger merger(kSide, kSide, settings16());
  for (const double time : {0.01, 0.1, 1.0})
    ASSERT_TRUE(merger.add(exposed(grey, time, random), time));
  const MergedBracket merged = merger.result();
  for (int c = 0; c < 3; ++c) {
    double sum = 0, square = 0;
    for (const Rgb& texel : merged.radiance.texels) {
      sum += static_cast<double>(texel[c]);
      square += std::pow(static_cast<double>(texel[c]) / static_cast<double>(grey.texels[0][c]) - 1.0, 2);
    }
    const double n = kSide * kSide, value = static_cast<double>(grey.texels[0][c]);
    EXPECT_NEAR(sum / n, value, 0.005 * value) << "weights follow the noisy codes";
    EXPECT_LT(std::sqrt(square / n), 1.05 * std::sqrt(1.0 / (60000 * value)) + 0.001);
  }
  EXPECT_LT(merged.ghosts, static_cast<std::uint64_t>(0.001 * kSide * kSide));
}

} // namespace
} // namespace daylit
