// What the real programs refuse to write over, to read, and to be told: files and options that a user can get wrong.

#include <chrono>
#include <cmath>
#include <vector>

#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "tests/stress/good_files.h"

namespace daylit {
namespace {

using namespace test;

class FilesAndOptions : public GoodFiles {
protected:
  /// Of the running test alone.
  fs::path folder() { return copy_for(testing::UnitTest::GetInstance()->current_test_info()->name()); }
};

const std::string kSettings = " --regions uniform:2 --grid 2,2,2 --patch-size 1 --quality draft --quiet";

void expect_said(const Outcome& outcome, int exit_code, const std::vector<std::string>& said) {
  EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
  for (const std::string& part : said)
    EXPECT_NE(outcome.err.find(part), std::string::npos) << "no \"" << part << "\" in: " << outcome.err;
}

TEST_F(FilesAndOptions, a_bake_never_writes_over_what_it_reads) {
  const fs::path f = folder();
  for (const char* input : {"room.obj", "room.mtl", "./room.obj"}) {
    const std::string before = slurp(f / input);
    const Outcome outcome = run_in(f, std::string("daylit-precompute room.obj -o ") + input + kSettings + " --force");
    expect_said(outcome, 1, {input, "input of the same run"});
    EXPECT_EQ(slurp(f / input), before);
  }
  spill(f / "points.volume", "1 1 1\n");
  const std::string bake = "daylit-precompute room.obj --points points.volume -o points.volume --regions uniform:2 "
                           "--patch-size 1 --force --quiet";
  expect_said(run_in(f, bake), 1, {"points.volume", "input of the same run"});
  fs::create_symlink("room.obj", f / "link.volume");
  expect_said(run_in(f, "daylit-precompute room.obj -o link.volume --force" + kSettings), 1, {"input of the same run"});
}

TEST_F(FilesAndOptions, daylit_run_never_writes_over_what_it_reads) {
  if (!has_program("daylit-run"))
    GTEST_SKIP() << "this build has no daylit-run";
  const fs::path f = folder();
  const std::string good = slurp(f / "config.toml");
  for (const char* input :
       {"photo.exr", "sky.exr", "lens.yaml", "config.toml", "room.volume", "cube.obj", "room.obj"}) {
    spill(f / "config.toml", replaced(good, "out.exr", input));
    const std::string before = slurp(f / input);
    const Outcome outcome = run_in(f, "daylit-run config.toml --quiet --force");
    expect_said(outcome, 1, {input, "input of the same run"});
    EXPECT_EQ(slurp(f / input), before);
    EXPECT_FALSE(fs::exists(f / "out.png"));
  }
  spill(f / "config.toml", replaced(good, "out.png", "out.exr"));
  expect_said(run_in(f, "daylit-run config.toml --quiet"), 1, {"out.exr", "two outputs"});
}

TEST_F(FilesAndOptions, daylit_simulate_never_writes_over_what_it_reads) {
  if (!has_program("daylit-simulate"))
    GTEST_SKIP() << "this build has no daylit-simulate";
  const fs::path f = folder();
  spill(f / "day.toml", "[sky]\nmodel = \"overcast\"\n");
  expect_said(run_in(f, "daylit-simulate sky --sky day.toml -o day.toml --force"), 1, {"input of the same run"});
  fs::create_directory(f / "out");
  spill(f / "out/CONFIG.toml", "[sky]\nmodel = \"overcast\"\n[pose]\nposition = [1, 1.8, 1]\nlook_at = [1, 0.5, 0.2]\n"
                               "[room]\nmodel = \"../room.obj\"\n[[object]]\nmodel = \"../cube.obj\"\n"
                               "[output]\nsize = [16, 16]\n");
  const std::string scene = slurp(f / "out/CONFIG.toml");
  expect_said(run_in(f, "daylit-simulate out/CONFIG.toml -o out --spp 16 --quiet --force"), 1,
              {"CONFIG.toml", "input of the same run"});
  EXPECT_EQ(slurp(f / "out/CONFIG.toml"), scene);
}

TEST_F(FilesAndOptions, a_file_of_another_kind_is_replaced_only_with_force) {
  const fs::path f = folder();
  const std::string notes = "what I want to keep\n";
  spill(f / "notes.txt", notes);
  const std::string bake = "daylit-precompute room.obj -o notes.txt" + kSettings;
  expect_said(run_in(f, bake), 1, {"notes.txt", "not a volume", "--force"});
  EXPECT_EQ(slurp(f / "notes.txt"), notes);
  EXPECT_EQ(run_in(f, bake + " --force").exit_code, 0);
  EXPECT_EQ(run_in(f, bake).exit_code, 0) << "its own kind";
  spill(f / "a.volume.checkpoint", notes);
  expect_said(run_in(f, "daylit-precompute room.obj -o a.volume" + kSettings), 1, {"a.volume.checkpoint", "--force"});
  EXPECT_EQ(slurp(f / "a.volume.checkpoint"), notes);
  fs::create_directory(f / "folder.volume");
  expect_said(run_in(f, "daylit-precompute room.obj -o folder.volume --force" + kSettings), 1, {"folder"});
}

TEST_F(FilesAndOptions, pictures_of_another_kind_are_replaced_only_with_force) {
  if (!has_program("daylit-run") || !has_program("daylit-simulate"))
    GTEST_SKIP() << "this build has no daylit-run or no daylit-simulate";
  const fs::path f = folder();
  spill(f / "out.png", "not a picture\n");
  expect_said(run_in(f, "daylit-run config.toml --quiet"), 1, {"out.png", "not a PNG picture", "--force"});
  EXPECT_EQ(slurp(f / "out.png"), "not a picture\n");
  EXPECT_EQ(run_in(f, "daylit-run config.toml --quiet --force").exit_code, 0);
  EXPECT_EQ(run_in(f, "daylit-run config.toml --quiet").exit_code, 0) << "its own kind";
  spill(f / "day.toml", "[sky]\nmodel = \"overcast\"\n");
  const std::string sky = "daylit-simulate sky --sky day.toml --height 8 -o ";
  expect_said(run_in(f, sky + "room.mtl"), 1, {"room.mtl", "--force"});
  fs::create_directory(f / "demo");
  spill(f / "demo/room.obj", kRoom);
  expect_said(run_in(f, "daylit-simulate --demo overcast -o demo --size 16,16 --spp 16 --quiet"), 1,
              {"demo/room.obj", "--force"});
  EXPECT_EQ(slurp(f / "demo/room.obj"), kRoom);
}

TEST_F(FilesAndOptions, pipes_devices_and_folders_are_refused_at_once_wherever_a_file_is_read) {
  const fs::path f = folder();
  ASSERT_EQ(::mkfifo((f / "pipe").c_str(), 0600), 0);
  fs::create_directory(f / "folder");
  const std::string good = slurp(f / "config.toml");
  for (const std::string input : {"pipe", "/dev/zero", "folder"}) {
    fs::remove(f / "tape.epw");
    fs::create_symlink(input, f / "tape.epw");
    std::vector<std::string> commands = {"daylit-precompute " + input + " -o a.volume",
                                         "daylit-precompute check " + input,
                                         "daylit-precompute room.obj -o a.volume --points " + input,
                                         "daylit-probe " + input + " --sky sky.exr < points.txt",
                                         "daylit-probe room.volume --sky " + input + " < points.txt",
                                         "daylit-probe room.volume --sky tape.epw --time 06-21_12:30 < points.txt",
                                         "daylit-probe room.volume --sky sky.exr --projection fisheye:" + input +
                                             " < points.txt"};
    for (const char* named : {"sky.exr", "photo.exr", "lens.yaml", "room.obj", "room.volume", "cube.obj"})
      if (has_program("daylit-run")) {
        const std::string config = "config-" + std::to_string(commands.size()) + ".toml";
        spill(f / config, replaced(good, named, input));
        commands.push_back("daylit-run " + config);
      }
    if (has_program("daylit-run"))
      commands.push_back("daylit-run " + input);
    for (const std::string& command : commands) {
      const auto start = std::chrono::steady_clock::now();
      expect_said(run_in(f, replaced(command, "06-21_12:30", "\"06-21 12:30\"")), 1, {});
      EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(30)) << command;
    }
  }
}

TEST_F(FilesAndOptions, numbers_that_are_not_finite_are_refused_in_every_option) {
  const fs::path f = folder();
  for (const std::string n : {"nan", "inf", "-inf", "1e999"}) {
    std::vector<std::string> commands;
    for (const char* option : {"--spacing ", "--patch-size ", "--max-error "})
      commands.push_back("daylit-precompute room.obj -o a.volume --regions uniform:2 " + (option + n));
    for (const char* option : {"--sky-rotation ", "--ground-albedo ", "--lux ", "--projection angular --forward 1,0,",
                               "--projection angular --sky-up 0,1,"})
      commands.push_back("daylit-probe room.volume --sky sky.exr " + (option + n) + " < points.txt");
    if (has_program("daylit-simulate"))
      for (const char* option : {"--sky-rotation ", "--ground-albedo "})
        commands.push_back("daylit-simulate irradiance room.obj --sky sky.exr " + (option + n) + " < points.txt");
    for (const std::string& command : commands)
      EXPECT_EQ(run_in(f, command).exit_code, 2) << command;
    if (!has_program("daylit-run"))
      continue;
    const std::string good = slurp(root_ / "good/config.toml");
    spill(f / "config.toml", replaced(good, "[1.0, 1.8, 1.0]", "[1.0, " + (n == "1e999" ? "inf" : n) + ", 1.0]"));
    EXPECT_EQ(run_in(f, "daylit-run config.toml").exit_code, 1) << n;
  }
  EXPECT_FALSE(fs::exists(f / "a.volume"));
}

TEST_F(FilesAndOptions, threads_are_none_or_a_sensible_number) {
  const fs::path f = folder();
  std::vector<std::string> commands = {"daylit-precompute check room.obj", "daylit-probe room.volume --info",
                                       "daylit-precompute room.obj -o a.volume" + kSettings};
  if (has_program("daylit-run"))
    commands.push_back("daylit-run config.toml --quiet");
  if (has_program("daylit-simulate"))
    commands.push_back("daylit-simulate irradiance room.obj --sky sky.exr < points.txt --spp 16");
  for (const std::string& command : commands) {
    for (const char* bad : {"-1", "100000", "nan", "1.5", "2147483648"})
      EXPECT_EQ(run_in(f, command + " --threads " + bad).exit_code, 2) << command << " " << bad;
    for (const char* good : {"0", "1", "3"})
      EXPECT_EQ(run_in(f, command + " --threads " + good).exit_code, 0) << command << " " << good;
  }
}

Outcome probe(const fs::path& folder, const std::string& options) {
  return run_in(folder, "daylit-probe room.volume " + options + " < points.txt");
}

TEST_F(FilesAndOptions, a_word_that_an_option_does_not_know_is_refused_with_those_it_knows) {
  const fs::path f = folder();
  expect_said(run_in(f, "daylit-probe room.volume --sky sky.exr --layout unty < points.txt"), 2,
              {"unty is not known; one of: unity, unreal, three"});
  if (has_program("daylit-run"))
    expect_said(run_in(f, "daylit-run config.toml --renderer foo"), 2,
                {"--renderer: foo is not known; one of: rays, gl, osmesa, window"});
}

TEST_F(FilesAndOptions, a_sky_that_its_projection_does_not_fit_is_refused_with_the_one_that_does) {
  const fs::path f = folder();
  ASSERT_TRUE(write_exr(f / "square.exr", RgbImage(16, 16, Rgb(1.0f))));
  ASSERT_TRUE(write_exr(f / "wide.exr", RgbImage(32, 12, Rgb(1.0f))));
  ASSERT_TRUE(write_exr(f / "one.exr", RgbImage(1, 1, Rgb(1.0f))));
  expect_said(probe(f, "--sky square.exr"), 1, {"square.exr", "2:1", "16 x 16", "angular"});
  EXPECT_EQ(probe(f, "--sky square.exr --projection angular").exit_code, 0);
  expect_said(probe(f, "--sky sky.exr --projection angular"), 1, {"sky.exr", "square", "32 x 16"});
  expect_said(probe(f, "--sky wide.exr"), 1, {"wide.exr", "2:1", "32 x 12", "fisheye"});
  expect_said(probe(f, "--sky one.exr"), 1, {"one.exr", "1 x 1", "uniform"});
  expect_said(probe(f, "--sky sky.exr --projection fisheye:lens.yaml --ground-albedo 0.2"), 1, {"64 x 48", "32 x 16"});
}

TEST_F(FilesAndOptions, a_rendered_view_is_refused_with_the_projection_that_it_is) {
  const fs::path f = folder();
  const auto write = [&](const char* name, const std::string& variables, const std::string& resolution) {
    const int pixels = resolution == "-Y 4 +X 4" ? 16 : 8;
    spill(f / name, "#?RADIANCE\n" + variables + "FORMAT=32-bit_rle_rgbe\n\n" + resolution + "\n" +
                        std::string(4 * static_cast<std::size_t>(pixels), '\x80'));
  };
  write("flat.hdr", "VIEW= -vtv -vp 0 0 0 -vd 0 0 1 -vu 0 1 0 -vh 90 -vv 45\n", "-Y 2 +X 4");
  expect_said(probe(f, "--sky flat.hdr"), 1, {"flat.hdr", "VIEW= -vtv", "rpict -vta -vh 360 -vv 360"});
  write("probe.hdr", "VIEW= -vta -vd 0 1 0 -vu 0 0 1 -vh 360 -vv 360\n", "-Y 4 +X 4");
  expect_said(probe(f, "--sky probe.hdr"), 1, {"--projection angular --forward 0,1,0 --sky-up 0,0,1"});
  EXPECT_EQ(probe(f, "--sky probe.hdr --projection angular --forward 0,1,0 --sky-up 0,0,1").exit_code, 0);
  write("dome.hdr", "VIEW= -vta -vd 0 0 1 -vu 0 1 0 -vh 180 -vv 180\n", "-Y 4 +X 4");
  expect_said(probe(f, "--sky dome.hdr --projection angular"), 1, {"VIEW= -vta", "fisheye:LENS.yaml"});
  write("unset.hdr", "EXPOSURE=0\n", "-Y 2 +X 4");
  expect_said(probe(f, "--sky unset.hdr"), 0, {"unset.hdr", "EXPOSURE=0"});
  EXPECT_EQ(probe(f, "--sky unset.hdr").out, probe(f, "--sky sky.hdr").out);
}

TEST_F(FilesAndOptions, options_without_effect_are_errors) {
  const fs::path f = folder();
  expect_said(probe(f, "--sky sky.exr --forward 0,1,0"), 2, {"--forward", "--projection angular"});
  expect_said(probe(f, "--sky sky.exr --sky-up 0,1,0"), 2, {"--sky-up"});
  expect_said(probe(f, "--sky sky.exr --ground-albedo 0.2"), 1, {"--ground-albedo", "whole sphere"});
  if (!has_program("daylit-run"))
    GTEST_SKIP() << "this build has no daylit-run";
  const std::string good = slurp(f / "config.toml");
  const auto run = [&](const std::string& from, const std::string& to) {
    spill(f / "config.toml", replaced(good, from, to));
    return run_in(f, "daylit-run config.toml --quiet");
  };
  expect_said(run("[interior]", "ground = { albedo = 0.2 }\n[interior]"), 1, {"line 3", "ground", "no effect"});
  expect_said(run("[pose]", "[marker]\nids = [23]\n[pose]"), 1, {"line 6", "marker", "[pose]", "no effect"});
  EXPECT_EQ(run("model = \"room.obj\"\n", "").exit_code, 0) << "the volume has the room";
}

TEST_F(FilesAndOptions, a_volume_of_another_room_is_refused) {
  if (!has_program("daylit-run"))
    GTEST_SKIP() << "this build has no daylit-run";
  const fs::path f = folder();
  EXPECT_EQ(run_in(f, "daylit-run config.toml --quiet").exit_code, 0);
  edit(f / "room.mtl", "0.5 0.5 0.5", "0.5 0.4 0.5");
  expect_said(run_in(f, "daylit-run config.toml --quiet"), 1, {"room.obj", "another room", "bake"});
}

TEST_F(FilesAndOptions, a_volume_is_compared_with_path_tracing_room_by_room_where_its_bake_was_measured) {
  if (!has_program("daylit-bench"))
    GTEST_SKIP() << "this build has no daylit-bench";
  const fs::path f = folder();
  const std::string compare = "daylit-bench volume room.volume --points 4 --samples 256 --suns 1 --json --quiet";
  expect_said(run_in(f, "daylit-precompute room.obj -o room.volume --force" + kSettings), 0, {});
  expect_said(run_in(f, compare), 1, {"names no room", "--max-error"});
  expect_said(run_in(f, "daylit-precompute room.obj -o room.volume --force --max-error 10 --quiet"), 0, {});
  const Outcome outcome = run_in(f, compare);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto rooms = nlohmann::json::parse(outcome.out)["rooms"];
  ASSERT_EQ(rooms.size(), 1u);
  EXPECT_EQ(rooms[0]["points"].size(), 4u);
  EXPECT_GT(rooms[0]["smooth_claimed"], 0.0);
  EXPECT_LT(rooms[0]["smooth"], 0.2);
}

TEST_F(FilesAndOptions, a_lens_that_folds_back_inside_its_picture_is_refused) {
  const fs::path f = folder();
  // r (1 - 0.9 r^2) turns at r = 0.61, 31 degrees from the axis; the corner lies at r = 0.65.
  const std::string folding = "distortion_model: plumb_bob\ndistortion_coefficients: [-0.9, 0, 0, 0]\n";
  const std::string good = slurp(f / "lens.yaml");
  spill(f / "lens.yaml", replaced(good, "distortion_model: plumb_bob\n", folding));
  const std::string command = "--sky sky.exr --projection fisheye:lens.yaml --ground-albedo 0.2";
  expect_said(probe(f, command), 1, {"lens.yaml", "distortion_coefficients", "folds back 31.", "max_theta_deg"});
  ASSERT_TRUE(write_exr(f / "sky.exr", RgbImage(64, 48, Rgb(1.0f))));
  spill(f / "lens.yaml", slurp(f / "lens.yaml") + "max_theta_deg: 31\n");
  expect_said(probe(f, command), 0, {"not of a fish-eye", "is it the interior camera's file?"});
}

} // namespace
} // namespace daylit
