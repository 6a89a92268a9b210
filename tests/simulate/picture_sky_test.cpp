// A scene whose sky is a picture: the truth under it, and what daylit-run is told about it.

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "scene/config/config.h"
#include "scene/image/image_formats.h"
#include "simulate/build_scene.h"
#include "simulate/irradiance.h"
#include "simulate/picture.h"
#include "simulate/sample_scene.h"
#include "simulate/simulate_command.h"

namespace daylit {
namespace {

class PictureSky : public testing::Test {
protected:
  std::filesystem::path folder_;

  void SetUp() override {
    folder_ = std::filesystem::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }

  /// The demo's overcast scene, its [sky] replaced by `sky`.
  std::filesystem::path scene(const std::string& sky) {
    EXPECT_TRUE(write_sample_scene("overcast", folder_, 32, 31));
    SimulateConfig config = *sample_scene("overcast", 32, 31);
    std::string text = to_toml(config);
    const std::size_t rest = text.find("\n[interior]");
    std::ofstream(folder_ / "picture.toml") << "[sky]\n" << sky << text.substr(rest);
    return folder_ / "picture.toml";
  }

  void write_overcast(const char* name) {
    EXPECT_TRUE(
        write_exr(folder_ / name, render_sky_panorama(AnalyticSky(sample_scene("overcast", 32, 31)->sky_model), 128)));
  }
};

TEST_F(PictureSky, picture_of_the_overcast_formula_lights_a_scene_as_the_formula_does) {
  write_overcast("overcast.exr");
  const auto config = read_simulate_config(scene("image = \"overcast.exr\"\n"));
  ASSERT_TRUE(config) << config.error().message();
  const auto pictured = build_scene(*config);
  ASSERT_TRUE(pictured) << pictured.error().message();
  const auto described = build_scene(*read_simulate_config(folder_ / "scene.toml"));
  ASSERT_TRUE(described) << described.error().message();
  const std::vector<Receiver> points{
      {{1.4, 1.4, 1.3}, {0, 0, 1}}, {{1.4, 1.4, 1.3}, {1, 0, 0}}, {{0.4, 2, 0.3}, {0, -1, 0}}};
  const IrradianceSettings settings{.samples = 1 << 15, .seed = 1, .indirect = true, .direct = true};
  const auto a = trace_irradiance(*pictured, points, settings), b = trace_irradiance(*described, points, settings);
  ASSERT_TRUE(a && b);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const float error = std::hypot((*a)[i].standard_error.g, (*b)[i].standard_error.g);
    EXPECT_NEAR((*a)[i].value.g, (*b)[i].value.g, 4.0f * error) << i;
    EXPECT_LT(error, 0.01f * (*b)[i].value.g) << i; // the comparison means something
  }
}

TEST_F(PictureSky, run_reads_the_very_picture_that_lit_the_truth) {
  RgbImage sky(8, 4, Rgb(0.5f));
  sky.at(1, 1) = Rgb(3.0f, 2.0f, 1.0f);
  ASSERT_TRUE(write_exr(folder_ / "my sky.exr", sky));
  SimulateArguments arguments;
  arguments.scene = scene("image = \"my sky.exr\"\nrotation = 90\n");
  arguments.folder = folder_ / "out";
  arguments.samples = 16;
  arguments.quiet = true;
  const auto done = run_simulate(arguments);
  ASSERT_TRUE(done) << done.error().message();
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/sky.yaml"));
  const auto run = read_run_config(folder_ / "out/CONFIG.toml");
  ASSERT_TRUE(run) << run.error().message();
  const auto picture = read_sky(run->sky);
  ASSERT_TRUE(picture) << picture.error().message();
  const auto traced = build_scene(*read_simulate_config(arguments.scene));
  ASSERT_TRUE(traced);
  int bright = 0;
  for (int k = 0; k < 64; ++k) {
    const double azimuth = 0.1 * k;
    const glm::dvec3 d(0.8 * std::cos(azimuth), 0.8 * std::sin(azimuth), 0.6);
    EXPECT_EQ(picture->radiance(d), traced->sky().radiance(glm::vec3(d)));
    bright += picture->radiance(d).r == 3.0f ? 1 : 0;
  }
  EXPECT_GT(bright, 0);
}

TEST_F(PictureSky, what_a_picture_has_no_use_for_is_refused) {
  write_overcast("overcast.exr");
  const auto both = read_simulate_config(scene("image = \"overcast.exr\"\nmodel = \"overcast\"\n"));
  ASSERT_FALSE(both);
  EXPECT_NE(both.error().message().find("keep one"), std::string::npos) << both.error().message();
  const auto fisheye = read_simulate_config(scene("image = \"overcast.exr\"\n[fisheye]\nfov = 180\n"));
  ASSERT_FALSE(fisheye);
  EXPECT_NE(fisheye.error().message().find("[fisheye]"), std::string::npos) << fisheye.error().message();
  SimulateConfig moving = *sample_scene("sun", 32, 31);
  ASSERT_FALSE(moving.sun_path.empty());
  moving.run.sky.image = "overcast.exr";
  std::ofstream(folder_ / "moving.toml") << to_toml(moving);
  const auto path = read_simulate_config(folder_ / "moving.toml");
  ASSERT_FALSE(path);
  EXPECT_NE(path.error().message().find("no sun that could move"), std::string::npos) << path.error().message();
}

} // namespace
} // namespace daylit
