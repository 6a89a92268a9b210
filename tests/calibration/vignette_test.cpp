// Fall-off of a lens: known ones found again, and what is said of pictures that do not serve.

#include <cmath>
#include <fstream>
#include <random>

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "calibration/vignette_fit.h"
#include "scene/image/image_formats.h"
#include "tests/calibration/calibrate_program.h"

namespace daylit::calibration {
namespace {

namespace fs = std::filesystem;

const FallOff kTruth{{-0.12, 0.03, -0.012}};

LensModel fisheye() { return ideal_fisheye(400, 400, 3.1415926); }

/// An evenly lit surface but for light that rises along a line, with noise.
RgbImage flat_field(double rise, unsigned seed) {
  const LensModel lens = fisheye();
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(1.0, 0.01);
  RgbImage picture(400, 400);
  for (int y = 0; y < 400; ++y)
    for (int x = 0; x < 400; ++x)
      if (const auto d = lens.unproject({x, y}))
        picture.at(x, y) =
            Rgb(static_cast<float>(0.6 * kTruth.at(std::acos(d->z)) * (1 + rise * (x - 200) / 400.0) * noise(random)));
  return picture;
}

/// A small lamp in that direction, of the same light wherever it is.
RgbImage lamp(double theta, double phi) {
  const LensModel lens = fisheye();
  const glm::dvec3 to(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
  RgbImage picture(400, 400, Rgb(0.01f));
  for (int y = 0; y < 400; ++y)
    for (int x = 0; x < 400; ++x)
      if (const auto d = lens.unproject({x, y}))
        picture.at(x, y) +=
            static_cast<float>(kTruth.at(theta) * std::exp(-0.5 * std::pow(glm::distance(*d, to) / 0.02, 2)));
  return picture;
}

void expect_found(const FallOff& found, double reach, double within) {
  for (double t = 0; t < reach; t += 0.05)
    EXPECT_NEAR(found.at(t), kTruth.at(t), within) << "at " << t;
}

TEST(Vignette, a_flat_field_gives_the_fall_off_and_a_slope_of_the_light_cancels) {
  std::vector<FallOffSample> samples;
  for (unsigned k = 0; k < 2; ++k)
    for (const FallOffSample& s : ring_samples(flat_field(k == 0 ? 0.3 : -0.1, k), fisheye(), k))
      samples.push_back({s.theta, (k + 1.0) * s.value, s.source});
  const auto fit = fit_fall_off(samples);
  ASSERT_TRUE(fit) << fit.error().message();
  expect_found(fit->fall_off, 1.5, 0.01);
  EXPECT_LT(fit->held_out, 0.01);
}

TEST(Vignette, samples_near_the_axis_alone_are_refused) {
  std::vector<FallOffSample> samples;
  for (int k = 0; k < 20; ++k)
    samples.push_back({0.02 * k, 1.0, 0});
  EXPECT_FALSE(fit_fall_off(samples));
}

TEST(VignetteProgram, codes_of_8_bits_are_no_light_unless_it_is_said) {
  const fs::path folder = test::fresh_folder("vignette-codes");
  ASSERT_TRUE(write_lens(folder / "lens.yaml", fisheye()));
  ASSERT_TRUE(write_png(folder / "paper.png", to_srgb8(flat_field(0.1, 1), 1.0f)));
  const std::string vignette = "vignette paper.png --lens lens.yaml -o fall.txt ";
  EXPECT_EQ(test::calibrate(folder, vignette).exit_code, 1);
  EXPECT_FALSE(fs::exists(folder / "fall.txt"));
  EXPECT_EQ(test::calibrate(folder, vignette + "--response srgb").json.value("verdict", ""), "pass");
  const auto fall_off = read_fall_off(folder / "fall.txt");
  ASSERT_TRUE(fall_off);
  expect_found(*fall_off, 1.4, 0.02);
}

TEST(VignetteProgram, uneven_light_is_said_and_replaces_no_file) {
  const fs::path folder = test::fresh_folder("vignette-uneven");
  ASSERT_TRUE(write_lens(folder / "lens.yaml", fisheye()));
  RgbImage uneven = flat_field(0.0, 1);
  for (int y = 0; y < 400; ++y)
    for (int x = 0; x < 400; ++x)
      uneven.at(x, y) *= static_cast<float>(1 + 0.5 * std::pow((x - 200) / 200.0, 2));
  ASSERT_TRUE(write_exr(folder / "even.exr", flat_field(0.3, 2)));
  ASSERT_TRUE(write_exr(folder / "uneven.exr", uneven));
  EXPECT_EQ(test::calibrate(folder, "vignette even.exr --lens lens.yaml -o fall.txt").json.value("verdict", ""),
            "pass");
  const auto kept = test::calibrate(folder, "vignette uneven.exr --lens lens.yaml -o fall.txt --quiet");
  EXPECT_EQ(kept.exit_code, 1);
  EXPECT_TRUE(test::says(kept, "around a ring")) << kept.json;
  EXPECT_TRUE(test::says(kept, "fall.txt is left as it was")) << kept.json;
  const auto fall_off = read_fall_off(folder / "fall.txt");
  ASSERT_TRUE(fall_off);
  expect_found(*fall_off, 1.4, 0.02);
  EXPECT_EQ(test::calibrate(folder, "vignette uneven.exr --lens lens.yaml -o fall.txt --force").exit_code, 0);
  EXPECT_EQ(test::calibrate(folder, "vignette uneven.exr --lens lens.yaml -o new.txt").exit_code, 0);
  const std::string program = "cd '" + folder.string() + "' && " DAYLIT_BINARY_DIR "/bin/daylit-calibrate ";
  EXPECT_EQ(std::system((program + "vignette uneven.exr --lens lens.yaml -o fall.txt --quiet 2> said.txt").c_str()) ==
                0,
            false);
  std::ifstream said(folder / "said.txt");
  std::string line;
  std::getline(said, line);
  EXPECT_NE(line.find("repeat: the light varies"), std::string::npos) << line;
}

TEST(VignetteProgram, a_report_in_the_place_of_a_file_is_refused) {
  const fs::path folder = test::fresh_folder("vignette-report");
  ASSERT_TRUE(write_lens(folder / "lens.yaml", fisheye()));
  ASSERT_TRUE(write_exr(folder / "even.exr", flat_field(0.3, 2)));
  test::calibrate(folder, "vignette even.exr --lens lens.yaml -o fall.txt --report lens.yaml");
  std::ifstream said(folder / "stderr.txt");
  std::string line;
  std::getline(said, line);
  EXPECT_NE(line.find("is a file, not a folder"), std::string::npos) << line;
}

TEST(VignetteProgram, a_lamp_at_several_angles_gives_the_fall_off) {
  const fs::path folder = test::fresh_folder("vignette");
  ASSERT_TRUE(write_lens(folder / "lens.yaml", fisheye()));
  std::string names;
  for (int k = 0; k < 9; ++k) {
    const std::string name = "lamp" + std::to_string(k) + ".exr";
    ASSERT_TRUE(write_exr(folder / name, lamp(0.05 + 0.17 * k, 0.7 * k)));
    names += name + " ";
  }
  const auto found = test::calibrate(folder, "vignette " + names + "--lamp --lens lens.yaml -o fall.txt --report r");
  EXPECT_EQ(found.exit_code, 0);
  EXPECT_EQ(found.json.value("verdict", ""), "pass") << found.json;
  const auto fall_off = read_fall_off(folder / "fall.txt");
  ASSERT_TRUE(fall_off);
  expect_found(*fall_off, 1.4, 0.02);
  const auto dark = test::calibrate(folder, "vignette lamp0.exr --lamp --lens lens.yaml -o none.txt");
  EXPECT_EQ(dark.exit_code, 1);
  EXPECT_EQ(dark.json.value("verdict", ""), "repeat");
}

} // namespace
} // namespace daylit::calibration
