// The whole way at half size, through the programs as a user runs them: simulate, bake, draw, compare with the truth.

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace {

const std::string kBin = DAYLIT_BINARY_DIR "/bin/";

int shell(const std::string& command) { return std::system(command.c_str()); }

/// Picture errors of one demo scene as daylit-simulate compare prints them; empty when a program failed.
nlohmann::json picture_error(const std::string& scene) {
  const std::string folder = DAYLIT_BINARY_DIR "/demo-test/" + scene;
  std::filesystem::create_directories(folder);
  const std::string steps[] = {
      kBin + "daylit-simulate --demo " + scene + " -o " + folder + " --size 256,248 --quiet",
      kBin + "daylit-precompute " + folder + "/room.obj -o " + folder + "/room.volume --quiet",
      kBin + "daylit-run " + folder + "/CONFIG.toml --quiet",
      kBin + "daylit-simulate compare " + folder + " --json > " + folder + "/errors.json",
  };
  for (const std::string& step : steps)
    if (shell(step) != 0) {
      ADD_FAILURE() << "failed: " << step;
      return {};
    }
  std::ifstream file(folder + "/errors.json");
  return nlohmann::json::parse(file, nullptr, false);
}

/// Relative RMS on the object; the truth's own standard error must be a quarter of the bar at most.
void expect_object_within(const std::string& scene, double bar) {
  const nlohmann::json e = picture_error(scene);
  ASSERT_TRUE(e.is_object()) << e.dump();
  std::printf("%s: %s\n", scene.c_str(), e.dump().c_str());
  EXPECT_LE(e["object"]["relative_rms"].get<double>(), bar);
  EXPECT_LE(e["object"]["truth_standard_error"].get<double>(), 0.25 * bar);
  EXPECT_GE(e["mask_iou"].get<double>(), 0.97);
  EXPECT_GE(e["object_share"].get<double>(), 0.05);
  EXPECT_LE(e["object_share"].get<double>(), 0.15);
}

TEST(Demo, object_under_the_overcast_sky_is_within_six_percent) { expect_object_within("overcast", 0.06); }
TEST(Demo, object_in_the_sun_is_within_twelve_percent) { expect_object_within("sun", 0.12); }

TEST(Demo, object_in_the_shade_beside_a_sun_patch_is_drawn_and_its_error_printed) {
  const nlohmann::json e = picture_error("shade");
  ASSERT_TRUE(e.is_object());
  std::printf("shade: %s\n", e.dump().c_str());
}

} // namespace
