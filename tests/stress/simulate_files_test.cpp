// daylit-simulate: when it makes its folder, what it says of a scene, and what it compares and writes over.

#include <string>
#include <vector>

#include "tests/stress/good_files.h"

namespace daylit {
namespace {

using namespace test;

const std::string kScene = "[sky]\nmodel = \"overcast\"\n[pose]\nposition = [1, 1.8, 1]\nlook_at = [1, 0.5, 0.2]\n"
                           "[room]\nmodel = \"room.obj\"\n[[object]]\nmodel = \"cube.obj\"\nposition = [1, 0.8, 0]\n"
                           "[output]\nsize = [16, 16]\n";

class SimulateFiles : public GoodFiles {
protected:
  void SetUp() override {
    if (!has_program("daylit-simulate"))
      GTEST_SKIP() << "this build has no daylit-simulate";
    folder_ = copy_for(testing::UnitTest::GetInstance()->current_test_info()->name());
  }
  Outcome simulate(const std::string& scene) {
    spill(folder_ / "scene.toml", scene);
    return run_in(folder_, "daylit-simulate scene.toml -o out --spp 16");
  }
  /// The truth as a result, as if daylit-run had drawn it.
  void make_result() {
    ASSERT_EQ(simulate(kScene).exit_code, 0);
    fs::copy_file(folder_ / "out/truth.exr", folder_ / "out/result.exr");
  }
  Outcome compare(const std::string& options = "") { return run_in(folder_, "daylit-simulate compare out " + options); }
  fs::path folder_;
};

void expect_said(const Outcome& outcome, int exit_code, const std::vector<std::string>& said) {
  EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
  for (const std::string& part : said)
    EXPECT_NE(outcome.err.find(part), std::string::npos) << "no \"" << part << "\" in: " << outcome.err;
}

TEST_F(SimulateFiles, a_bad_scene_leaves_no_folder_behind) {
  expect_said(simulate("[sky]\nmodel = \"overcasst\"\n"), 1, {"overcasst"});
  expect_said(simulate(replaced(kScene, "room.obj", "no.obj")), 1, {"no.obj"});
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  expect_said(simulate(kScene), 0, {});
  EXPECT_TRUE(fs::exists(folder_ / "out/CONFIG.toml"));
  fs::remove_all(folder_ / "out");
  spill(folder_ / "out", "a file");
  expect_said(simulate(kScene), 1, {"cannot create the folder", "out", "-o"});
}

TEST_F(SimulateFiles, objects_that_would_tip_or_are_cut_are_warned_of_as_by_daylit_run) {
  const std::string cut = "cube.obj intersects the room: \"wall\" cuts through it";
  EXPECT_EQ(simulate(kScene).err.find(cut), std::string::npos);
  expect_said(simulate(replaced(kScene, "0.8, 0]", "0.8, -0.1]")), 0, {cut});
  // A corner on the floor.
  expect_said(simulate(replaced(kScene, "position = [1, 0.8, 0]", "on = [1, 0.8]\nrotation = [40, 30, 0]")), 0,
              {"cube.obj would tip over"});
}

TEST_F(SimulateFiles, a_lens_of_another_shape_than_the_output_is_refused) {
  const std::string scene = replaced(kScene, "[room]", "[interior]\nlens = \"lens.yaml\"\n[room]");
  expect_said(simulate(scene), 1, {"[output] size 16 x 16 is not of the shape of lens.yaml, 64 x 48"});
  EXPECT_EQ(simulate(replaced(scene, "[16, 16]", "[16, 12]")).exit_code, 0) << "the result is that much smaller";
}

TEST_F(SimulateFiles, compare_says_which_program_makes_a_missing_picture) {
  ASSERT_EQ(simulate(kScene).exit_code, 0);
  expect_said(compare(), 1, {"result.exr", "run daylit-run out/CONFIG.toml first"});
  expect_said(compare("--result sky.exr --frame 3"), 1, {"truth_0003.exr", "daylit-simulate SCENE.toml -o out"});
}

TEST_F(SimulateFiles, compare_replaces_its_own_picture_and_none_of_the_run) {
  make_result();
  const std::string truth = slurp(folder_ / "out/truth.png");
  expect_said(compare("-o out/truth.png"), 1, {"out/truth.png", "picture of the run", "--force"});
  EXPECT_EQ(slurp(folder_ / "out/truth.png"), truth);
  expect_said(compare("-o out/c.png"), 0, {});
  expect_said(compare("-o out/c.png"), 0, {});
  expect_said(compare("-o out/truth.png --force"), 0, {});
  expect_said(compare("-o c.jpg"), 2, {"c.jpg", ".png"});
  EXPECT_FALSE(fs::exists(folder_ / "c.jpg"));
}

} // namespace
} // namespace daylit
