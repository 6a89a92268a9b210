// Pictures as a camera would have taken them: lenses of scenes, and what becomes of light.

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "scene/image/image_formats.h"
#include "scene/lens/fall_off.h"
#include "simulate/photograph_command.h"
#include "simulate/sample_scene.h"
#include "simulate/simulate_command.h"

namespace daylit {
namespace {

class Develop : public testing::Test {
protected:
  void SetUp() override {
    folder_ = std::filesystem::path(testing::TempDir()) /
              ("develop-" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  std::filesystem::path folder_;
};

TEST_F(Develop, codes_follow_exposure_colours_and_curve_and_the_mean_is_metered) {
  RgbImage light(64, 2);
  for (int x = 0; x < 64; ++x)
    light.at(x, 0) = light.at(x, 1) = Rgb(0.2f * static_cast<float>(x), 3.0f, 0.0f);
  ASSERT_TRUE(write_exr(folder_ / "in.exr", light));
  DevelopArguments a;
  a.picture = folder_ / "in.exr";
  a.output = folder_ / "out.png";
  a.exposure = 0.1;
  a.camera_from_rec709 = {1, 0.1, 0, 0, 1, 0, 0, 0.2, 1};
  a.logarithmic = 30;
  a.quiet = true;
  ASSERT_TRUE(run_develop(a));
  const auto codes = read_ldr_image(a.output);
  ASSERT_TRUE(codes);
  for (std::size_t x = 0; x < 64; ++x) {
    const double wanted[] = {0.1 * (0.2 * static_cast<double>(x) + 0.3), 0.3, 0.06};
    for (std::size_t c = 0; c < 3; ++c) {
      const double code = codes->bytes[3 * x + c] / 255.0, v = (std::pow(31.0, code) - 1) / 30;
      EXPECT_NEAR(v, std::min(wanted[c], 1.0), 0.007) << x << " " << c; // half a code at white
    }
  }
  a.output = folder_ / "out.exr";
  a.camera_from_rec709 = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  a.mean = 0.25;
  ASSERT_TRUE(run_develop(a));
  const auto metered = read_hdr_image(a.output);
  ASSERT_TRUE(metered);
  double mean = 0;
  for (const Rgb& texel : metered->radiance.texels)
    mean += static_cast<double>(luminance(texel)) / 128;
  EXPECT_NEAR(mean, 0.25, 1e-4);
}

TEST_F(Develop, a_lens_takes_its_fall_off) {
  const LensModel lens = ideal_fisheye(65, 65, 3.0);
  ASSERT_TRUE(write_lens(folder_ / "lens.yaml", lens));
  ASSERT_TRUE(write_fall_off(folder_ / "fall.txt", FallOff{{-0.2}}));
  ASSERT_TRUE(write_exr(folder_ / "in.exr", RgbImage(65, 65, Rgb(1.0f))));
  DevelopArguments a;
  a.picture = folder_ / "in.exr";
  a.output = folder_ / "out.exr";
  a.lens = folder_ / "lens.yaml";
  a.quiet = true;
  EXPECT_FALSE(run_develop(a)) << "a lens alone has no use";
  a.fall_off = folder_ / "fall.txt";
  ASSERT_TRUE(run_develop(a));
  const auto out = read_hdr_image(a.output);
  ASSERT_TRUE(out);
  EXPECT_NEAR(out->radiance.at(32, 32).g, 1.0f, 1e-3f);
  const double t = std::acos(lens.unproject({60, 32})->z);
  EXPECT_NEAR(out->radiance.at(60, 32).g, 1 - 0.2 * t * t, 1e-3);
}

TEST_F(Develop, a_scene_is_seen_through_the_lens_files_that_it_names) {
  ASSERT_TRUE(write_sample_scene("overcast", folder_, 20, 15));
  LensModel camera = ideal_pinhole(40, 30, 0.5), sky = ideal_fisheye(32, 32, 3.0);
  camera.distortion[0] = -0.2;
  sky.distortion[0] = -0.01;
  ASSERT_TRUE(write_lens(folder_ / "camera.yaml", camera) && write_lens(folder_ / "upward.yaml", sky));
  std::ifstream file(folder_ / "scene.toml");
  std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto replace_section = [&text](const std::string& section, const std::string& content) {
    const std::size_t from = text.find("[" + section + "]\n"), to = text.find("\n\n", from);
    text.replace(from, to - from, "[" + section + "]\n" + content);
  };
  replace_section("interior", "lens = \"camera.yaml\"");
  replace_section("fisheye", "lens = \"upward.yaml\"");
  std::ofstream(folder_ / "lens.toml") << text;
  SimulateArguments a;
  a.scene = folder_ / "lens.toml";
  a.folder = folder_ / "out";
  a.samples = 16;
  a.quiet = true;
  const auto done = run_simulate(a);
  ASSERT_TRUE(done) << done.error().message();
  EXPECT_NEAR(read_lens(folder_ / "out/interior.yaml")->distortion[0], -0.2, 1e-9);
  EXPECT_NEAR(read_lens(folder_ / "out/sky.yaml")->distortion[0], -0.01, 1e-9);
  EXPECT_EQ(read_hdr_image(folder_ / "out/interior.exr")->radiance.width, 40);
  const auto again = read_simulate_config(folder_ / "lens.toml");
  ASSERT_TRUE(again);
  EXPECT_NE(to_toml(*again).find("camera.yaml"), std::string::npos);
  replace_section("interior", "lens = \"camera.yaml\"\nfov = 30");
  std::ofstream(folder_ / "both.toml") << text;
  EXPECT_FALSE(read_simulate_config(folder_ / "both.toml"));
}

} // namespace
} // namespace daylit
