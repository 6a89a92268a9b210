// Colours of a chart: known cameras found again, a real chart, and what is said of pictures that do not serve.

#include <cmath>
#include <random>

#include <glm/matrix.hpp>
#include <gtest/gtest.h>

#include "calibration/colour_fit.h"
#include "scene/image/image_formats.h"
#include "tests/calibration/calibrate_program.h"

namespace daylit::calibration {
namespace {

namespace fs = std::filesystem;

const fs::path kData = fs::path(DAYLIT_SOURCE_DIR) / "../shared/data/colorchecker";

/// A camera whose channels overlap, white-balanced to within a fifth.
const glm::dmat3 kCamera{{0.50, 0.16, 0.04}, {0.32, 0.56, 0.20}, {0.06, 0.20, 0.55}};

/// A photograph of the chart: patches on black, on a grey wall; relative noise; light that falls off to the right.
RgbImage chart_picture(double noise, double fall_off, const glm::dmat3& camera, double power) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const ChartReference chart = published_chart();
  RgbImage picture(640, 480);
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 640; ++x) {
      const double u = (x - 80) / 80.0, v = (y - 80) / 80.0;
      glm::dvec3 colour(0.35);
      if (u > -0.2 && v > -0.2 && u < 6.2 && v < 4.2) {
        const bool gap = u < 0 || v < 0 || u >= 6 || v >= 4 || std::abs(u - std::floor(u) - 0.5) > 0.42 ||
                         std::abs(v - std::floor(v) - 0.5) > 0.42;
        colour =
            gap ? glm::dvec3(0.03) : chart[static_cast<std::size_t>(6 * static_cast<int>(v) + static_cast<int>(u))];
      }
      const glm::dvec3 code = 0.9 * (1.0 - fall_off * x / 640.0) * (camera * colour);
      for (int c = 0; c < 3; ++c)
        picture.at(x, y)[c] =
            static_cast<float>(std::pow(std::clamp(code[c] * (1 + noise * normal(random)), 0.0, 1.0), 1 / power));
    }
  return picture;
}

const ChartCorners kCorners{glm::dvec2(120, 120), glm::dvec2(520, 120), glm::dvec2(520, 360), glm::dvec2(120, 360)};

TEST(Colour, delta_e_2000_is_as_published) { // Sharma, Wu, Dalal 2005, table 1, pairs 1, 4, 7, 17, 25
  EXPECT_NEAR(delta_e_2000({50, 2.6772, -79.7751}, {50, 0, -82.7485}), 2.0425, 1e-4);
  EXPECT_NEAR(delta_e_2000({50, -1.3802, -84.2814}, {50, 0, -82.7485}), 1.0000, 1e-4);
  EXPECT_NEAR(delta_e_2000({50, 0, 0}, {50, -1, 2}), 2.3669, 1e-4);
  EXPECT_NEAR(delta_e_2000({50, 2.5, 0}, {73, 25, -18}), 27.1492, 1e-4);
  EXPECT_NEAR(delta_e_2000({60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}), 1.2644, 1e-4);
}

TEST(Colour, a_white_reflectance_is_white) {
  const std::vector<double> nm{400, 700}, one{1, 1};
  const glm::dvec3 white = rec709_of_reflectance(nm, one);
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(white[c], 1.0, 0.003);
}

TEST(Colour, a_linear_camera_is_found) {
  const auto patches = sample_chart(chart_picture(0.01, 0.0, kCamera, 1.0), kCorners);
  ASSERT_TRUE(patches);
  const auto fit = fit_colour(*patches, published_chart(), true);
  ASSERT_TRUE(fit) << fit.error().message();
  EXPECT_LT(fit->held_out, 0.5);
  EXPECT_GT(fit->before, 5.0);
  const glm::dmat3 product = fit->model.matrix() * kCamera * 0.9;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(product[c][r], r == c ? 1.0 : 0.0, 0.03);
}

TEST(Colour, noise_of_one_per_cent_in_the_patches_costs_less_than_two) {
  auto patches = *sample_chart(chart_picture(0.0, 0.0, kCamera, 1.0), kCorners);
  std::mt19937 random(1);
  std::normal_distribution<double> normal(1.0, 0.01);
  for (ChartPatch& p : patches)
    p.code *= glm::dvec3(normal(random), normal(random), normal(random));
  const auto fit = fit_colour(patches, published_chart(), true);
  ASSERT_TRUE(fit);
  EXPECT_LT(fit->held_out, 2.0);
}

TEST(Colour, a_curve_and_uneven_light_are_found) {
  const auto patches = sample_chart(chart_picture(0.005, 0.3, kCamera, 2.2), kCorners);
  ASSERT_TRUE(patches);
  const auto fit = fit_colour(*patches, published_chart(), false);
  ASSERT_TRUE(fit);
  EXPECT_TRUE(fit->model.terms.curve && fit->model.terms.uneven) << fit->model.terms.name();
  EXPECT_NEAR(fit->model.power, 2.2, 0.1);
  EXPECT_LT(fit->held_out, 1.0);
}

TEST(Colour, a_real_chart_is_met_within_five) {
  if (!fs::exists(kData))
    GTEST_SKIP() << "the shared photographs are not here";
  const fs::path folder = test::fresh_folder("chart");
  const auto found =
      test::calibrate(folder, "colour " + (kData / "d2_colorChecker30cm_d3_wb.tif").string() + " --reference " +
                                  (kData / "spectra_averaged.csv").string() + " -o colour.toml --report r");
  EXPECT_EQ(found.exit_code, 0);
  EXPECT_EQ(found.json.value("verdict", ""), "pass") << found.json;
  EXPECT_LE(found.json.value("delta_e_held_out", 99.0), 5.0);
  EXPECT_TRUE(fs::exists(folder / "r/report.html"));
}

TEST(ColourProgram, gives_the_matrix_to_another_camera_and_the_scale_of_a_spot) {
  const fs::path folder = test::fresh_folder("cameras");
  const glm::dmat3 other{{0.70, 0.10, 0.02}, {0.20, 0.60, 0.15}, {0.05, 0.12, 0.50}};
  EXPECT_TRUE(write_exr(folder / "a.exr", chart_picture(0.01, 0.0, kCamera, 1.0)));
  EXPECT_TRUE(write_exr(folder / "b.exr", chart_picture(0.01, 0.0, other, 1.0)));
  const auto found = test::calibrate(folder, "colour a.exr --to b.exr --spot 10,10,700 -o out.toml");
  ASSERT_EQ(found.exit_code, 0);
  const glm::dmat3 expected = other * glm::inverse(kCamera);
  for (int k = 0; k < 9; ++k)
    EXPECT_NEAR(found.json["camera_to_camera"]["matrix"][k].get<double>(), expected[k % 3][k / 3], 0.02) << k;
  EXPECT_LT(found.json["camera_to_camera"]["delta_e_held_out"], 0.5);
  EXPECT_GT(found.json["camera_to_camera"]["delta_e_before"], 3.0);
  EXPECT_NEAR(found.json["luminance_scale"].get<double>(), 700 / 0.35, 30) << "the wall's reflectance is 0.35";
  EXPECT_EQ(test::calibrate(folder, "colour a.exr --to b.exr --spot 10,10 -o out.toml").exit_code, 2);
  EXPECT_EQ(test::calibrate(folder, "colour a.exr --spot 9999,10,700 -o out.toml").exit_code, 2);
}

TEST(ColourProgram, says_that_the_chart_is_over_exposed_upside_down_or_not_there) {
  const fs::path folder = test::fresh_folder("upside");
  RgbImage picture = chart_picture(0.005, 0.0, kCamera, 2.2);
  const auto write = [&](float gain = 1.0f) {
    Rgb8Image bytes{picture.width, picture.height, {}};
    for (const Rgb& texel : picture.texels)
      for (int c = 0; c < 3; ++c)
        bytes.bytes.push_back(static_cast<std::uint8_t>(std::lround(255 * std::min(gain * texel[c], 1.0f))));
    EXPECT_TRUE(write_png(folder / "chart.png", bytes));
  };
  write(1.2f);
  const auto bright = test::calibrate(folder, "colour chart.png -o out.toml");
  EXPECT_EQ(bright.json.value("verdict", ""), "repeat");
  EXPECT_TRUE(test::says(bright, "over-exposed: ")) << bright.json;
  write();
  const auto good = test::calibrate(folder, "colour chart.png -o out.toml --force");
  EXPECT_EQ(good.json.value("verdict", ""), "pass") << good.json;
  std::ranges::reverse(picture.texels);
  write();
  for (const char* corners : {"", "--chart 120,120,520,120,520,360,120,360 "}) {
    const auto turned = test::calibrate(folder, std::string("colour chart.png -o out.toml ") + corners);
    EXPECT_EQ(turned.json.value("verdict", ""), "repeat");
    EXPECT_TRUE(test::says(turned, "chart upside down")) << turned.json;
  }
  std::ranges::fill(picture.texels, Rgb(0.4f));
  write();
  const auto none = test::calibrate(folder, "colour chart.png -o none.toml");
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_TRUE(test::says(none, "no chart")) << none.json;
  EXPECT_FALSE(fs::exists(folder / "none.toml"));
}

} // namespace
} // namespace daylit::calibration
