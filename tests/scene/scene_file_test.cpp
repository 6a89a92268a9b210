// SCENE.toml of daylit-simulate.

#include <cmath>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "config_files.h"

namespace daylit {
namespace {

using SceneFile = ConfigTest;

const std::string kScene =
    "[sky]\nmodel = \"overcast\"\n[pose]\nposition = [0,0,1]\nlook_at = [1,1,1]\n[room]\nmodel = "
    "\"r.obj\"\n[[object]]\nmodel = \"o.obj\"\n";

TEST_F(SceneFile, scene_file_reads_the_sky_model_and_round_trips) {
  const auto c = simulate("[sky]\nmodel = \"clear\"\nzenith_radiance = [1, 2, 3]\nground_albedo = 0.1\n"
                          "sun = { azimuth = 90, elevation = 30, normal_irradiance = 500 }\n"
                          "[pose]\nposition = [0,0,1]\nlook_at = [1,1,1]\n[room]\nmodel = \"r.obj\"\n"
                          "[[object]]\nmodel = \"o.obj\"\n[simulate]\nsamples = 17\n[output]\nsize = [64, 62]\n");
  ASSERT_TRUE(c) << c.error().message();
  EXPECT_EQ(c->sky_model.kind, SkyModel::Kind::clear);
  ASSERT_TRUE(c->sky_model.sun);
  EXPECT_NEAR(c->sky_model.sun->direction.y, std::sqrt(0.75), 1e-12);
  EXPECT_NEAR(c->sky_model.sun->direction.z, 0.5, 1e-12);
  EXPECT_FALSE(c->marker_board);
  const auto again = simulate(to_toml(*c));
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_EQ(to_toml(*again), to_toml(*c));
}

TEST_F(SceneFile, a_scene_names_no_files_to_write_and_takes_sixteen_paths_at_least) {
  EXPECT_TRUE(simulate(kScene + "[simulate]\nsamples = 16\n[output]\nsize = [64, 62]\n"));
  for (const char* wrong : {"[output]\npng = \"a.png\"\n", "[output]\nexr = \"a.exr\"\n",
                            "[output]\nmask = \"a.exr\"\n", "[simulate]\nsamples = 15\n"}) {
    const auto c = simulate(kScene + wrong);
    ASSERT_FALSE(c) << wrong;
    EXPECT_NE(c.error().message().find("line 11"), std::string::npos) << c.error().message();
  }
}

TEST_F(SceneFile, clear_sky_needs_a_sun_above_the_horizon) {
  const std::string rest = "[pose]\nposition = [0,0,1]\nlook_at = [1,1,1]\n[room]\nmodel = \"r.obj\"\n"
                           "[[object]]\nmodel = \"o.obj\"\n";
  EXPECT_FALSE(simulate("[sky]\nmodel = \"clear\"\n" + rest));
  EXPECT_FALSE(simulate("[sky]\nsun = { azimuth = 0, elevation = 0, normal_irradiance = 1 }\n" + rest));
  EXPECT_TRUE(simulate("[sky]\nmodel = \"overcast\"\n" + rest));
}

TEST_F(SceneFile, a_camera_that_looks_at_its_own_position_or_straight_down_is_told_so) {
  const auto said = [&](const std::string& text) {
    const auto c = simulate(text);
    return c ? std::string() : c.error().message();
  };
  const std::string own = said(replaced(kScene, "look_at = [1,1,1]", "look_at = [0,0,1]"));
  EXPECT_NE(own.find("line 5: [pose] look_at: the camera looks at its own position"), std::string::npos) << own;
  const std::string down = said(replaced(kScene, "look_at = [1,1,1]", "look_at = [0,0,0]"));
  EXPECT_NE(down.find("line 5: [pose] look_at: the view is vertical"), std::string::npos) << down;
  const std::string key = said(kScene + "[path]\ncamera = [[0,0,1, 1,1,1], [2,2,1, 2,2,1]]\n");
  EXPECT_NE(key.find("line 11: [path] camera: key 2: the camera looks at its own position"), std::string::npos) << key;
}

TEST_F(SceneFile, a_marker_that_cannot_be_printed_is_named_with_its_line) {
  const std::pair<const char*, const char*> wrong[] = {
      {"[marker]\nids = [7]\n", "line 11: [marker] ids: only marker 23"},
      {"[marker]\nids = [23]\ndictionary = \"4X4_50\"\n", "line 12: [marker] dictionary: only markers of 6X6_250"}};
  for (const auto& [marker, part] : wrong) {
    const auto c = simulate(kScene + marker);
    ASSERT_FALSE(c) << marker;
    EXPECT_NE(c.error().message().find(part), std::string::npos) << c.error().message();
    EXPECT_NE(c.error().message().find("CONFIG.toml"), std::string::npos) << c.error().message();
    EXPECT_TRUE(simulate(kScene + marker + "[simulate]\nmarker_board = false\n"));
  }
  EXPECT_TRUE(simulate(kScene + "[marker]\nids = [23]\n")->marker_board);
}

} // namespace
} // namespace daylit
