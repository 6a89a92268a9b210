// Many sittings with noise: how often a lens is right, and whether it knows how sure it is.

#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "calibration/lens_calibration.h"
#include "tests/calibration/board_case.h"

namespace daylit::calibration {
namespace {

using test::angle_error;
using test::circle_of;
using test::fisheye_views;
using test::go_on;
using test::kBoard;
using test::kDegree;

TEST(FisheyeCalibration, angles_are_right_to_a_twentieth_of_a_degree_and_wrong_pictures_are_named) {
  const LensModel truth = test::true_fisheye();
  const ImageCircle circle = circle_of(truth, 95 * kDegree);
  ASSERT_GE(2 * circle.radius, 1000.0);
  int good = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    const auto found = calibrate_views(LensKind::equidistant, kBoard, truth.width_px, truth.height_px, circle,
                                       fisheye_views(random, 0.2, true), {}, go_on);
    ASSERT_TRUE(found) << found.error().message();
    const bool named = found->dropped.size() == 2 && std::ranges::all_of(found->dropped, [](const DroppedPicture& d) {
                         return d.file.starts_with("wrong");
                       });
    const double error = angle_error(found->fit.lens, truth, circle, 0.85);
    good += named && error < 0.05 ? 1 : 0;
    if (!named || error >= 0.05)
      std::printf("seed %u: %.3f degrees, %zu left out, %.2f px, %s\n", seed, error, found->dropped.size(),
                  found->fit.rms_px, found->why[0].c_str());
  }
  EXPECT_GE(good, 19);
}

TEST(FisheyeCalibration, stated_deviations_are_those_of_repeated_sittings) {
  const LensModel truth = test::true_fisheye();
  const ImageCircle circle = circle_of(truth, 95 * kDegree);
  double sum = 0;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    std::mt19937 random(seed);
    const auto views = fisheye_views(random, 0.2, false);
    const auto fit = fit_lens(LensKind::equidistant, truth.width_px, truth.height_px, circle, views);
    ASSERT_TRUE(fit);
    sum += std::pow((fit->lens.cx - truth.cx) / fit->sigma[2], 2);
  }
  EXPECT_GT(sum / 30, 0.5); // chi squared of 30: 95 % within 0.6 and 1.5
  EXPECT_LT(sum / 30, 1.8);
}

} // namespace
} // namespace daylit::calibration
