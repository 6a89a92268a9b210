// Runs the real programs with bad input. Every case must end with exit code 1, say on stderr what is wrong, where and
// what to do, and leave no file behind, neither under the final nor under a temporary name.

#include <algorithm>
#include <functional>
#include <limits>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/stress/good_files.h"

namespace daylit {
namespace {

using namespace test;
class BadInput : public GoodFiles {};

struct Case {
  const char* name;
  const char* program;
  std::string arguments;
  std::function<void(const fs::path& folder)> spoil;
  std::vector<std::string> said; ///< each must occur on stderr
};

const std::string kBake = "room.obj -o out.volume --regions uniform:2 --quality draft";
const std::string kProbe = "room.volume --sky sky.exr < points.txt";

void truncate(const fs::path& path, double share) {
  fs::resize_file(path, static_cast<std::uintmax_t>(share * static_cast<double>(fs::file_size(path))));
}

void write_sky(const fs::path& folder, float value) {
  RgbImage sky(32, 16, Rgb(1.0f));
  sky.at(12, 5).g = value;
  ASSERT_TRUE(write_exr(folder / "sky.exr", sky));
}

const auto kNothing = [](const fs::path&) {};

std::vector<Case> room_cases() {
  const char* const program = "daylit-precompute";
  return {
      {"missing_room", program, "no.obj -o out.volume", kNothing, {"no.obj"}},
      {"truncated_room", program, kBake, [](auto& f) { truncate(f / "room.obj", 0.97); }, {"room.obj"}},
      {"room_cut_in_half", program, kBake, [](auto& f) { truncate(f / "room.obj", 0.5); }, {"room.obj"}},
      {"missing_materials", program, kBake, [](auto& f) { fs::remove(f / "room.mtl"); }, {"room.mtl"}},
      {"no_window_and_no_hole",
       program,
       kBake,
       [](auto& f) { edit(f / "room.obj", "usemtl window", "usemtl wall"); },
       {"window"}},
      {"only_faces_without_area",
       program,
       kBake,
       [](auto& f) { spill(f / "room.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"); },
       {"room.obj"}},
      {"reflectance_above_one",
       program,
       kBake,
       [](auto& f) { edit(f / "room.mtl", "0.5 0.5 0.5", "0.5 1.5 0.5"); },
       {"reflectance", "wall"}},
      {"reflectance_below_zero",
       program,
       kBake,
       [](auto& f) { edit(f / "room.mtl", "0.5 0.5 0.5", "0.5 -0.5 0.5"); },
       {"reflectance", "wall"}},
      {"vertex_is_nan", program, kBake, [](auto& f) { edit(f / "room.obj", "v 2 2 2", "v 2 nan 2"); }, {"room.obj"}},
      {"vertex_does_not_exist",
       program,
       kBake,
       [](auto& f) { edit(f / "room.obj", "f 1 5 6 2", "f 1 5 6 99"); },
       {"room.obj"}},
      {"output_folder_missing",
       program,
       "room.obj -o no/out.volume --regions uniform:2 --quality draft",
       kNothing,
       {"no/out.volume"}},
      {"bad_points_file",
       program,
       "room.obj -o out.volume --points points.txt",
       [](auto& f) { spill(f / "points.txt", "1 1 1\n1 one 1\n"); },
       {"points.txt", "2"}},
      {"check_closed_room",
       program,
       "check room.obj",
       [](auto& f) { edit(f / "room.obj", "usemtl window", "usemtl wall"); },
       {"window"}},
      {"check_missing_room", program, "check no.obj", kNothing, {"no.obj"}},
  };
}

std::vector<Case> sky_and_volume_cases() {
  const char* const program = "daylit-probe";
  return {
      {"missing_volume", program, "no.volume --sky sky.exr < points.txt", kNothing, {"no.volume"}},
      {"truncated_volume", program, kProbe, [](auto& f) { truncate(f / "room.volume", 0.7); }, {"room.volume"}},
      {"damaged_volume",
       program,
       kProbe,
       [](auto& f) {
         std::string bytes = slurp(f / "room.volume");
         bytes[bytes.size() - 9] = static_cast<char>(bytes[bytes.size() - 9] ^ 0x10);
         spill(f / "room.volume", bytes);
       },
       {"room.volume", "checksum"}},
      {"volume_of_another_version",
       program,
       kProbe,
       [](auto& f) { edit(f / "room.volume", "\"format_version\":\"2\"", "\"format_version\":\"7\""); },
       {"room.volume", "version 7"}},
      {"missing_sky", program, "room.volume --sky no.exr < points.txt", kNothing, {"no.exr"}},
      {"truncated_sky", program, kProbe, [](auto& f) { truncate(f / "sky.exr", 0.8); }, {"sky.exr"}},
      {"truncated_hdr_sky",
       program,
       "room.volume --sky sky.hdr < points.txt",
       [](auto& f) { truncate(f / "sky.hdr", 0.9); },
       {"sky.hdr"}},
      {"nan_in_the_sky",
       program,
       kProbe,
       [](auto& f) { write_sky(f, std::numeric_limits<float>::quiet_NaN()); },
       {"sky.exr", "(12, 5)", "1 pixel"}},
      {"infinity_in_the_sky",
       program,
       kProbe,
       [](auto& f) { write_sky(f, std::numeric_limits<float>::infinity()); },
       {"sky.exr", "(12, 5)"}},
      {"negative_radiance_in_the_sky",
       program,
       kProbe,
       [](auto& f) { write_sky(f, -0.5f); },
       {"sky.exr", "(12, 5)", "negative"}},
      {"fisheye_without_lens_file",
       program,
       "room.volume --sky sky.exr --projection fisheye:no.yaml < points.txt",
       kNothing,
       {"no.yaml"}},
      {"angular_map_that_is_not_square",
       program,
       "room.volume --sky sky.exr --projection angular < points.txt",
       kNothing,
       {"sky.exr", "square"}},
      {"point_that_is_no_number", program, kProbe, [](auto& f) { spill(f / "points.txt", "1 1 x 0 0 1\n"); }, {"1"}},
  };
}

std::vector<Case> run_cases() {
  const char* const program = "daylit-run";
  return {
      {"missing_config", program, "no.toml", kNothing, {"no.toml"}},
      {"unknown_config_key",
       program,
       "config.toml",
       [](auto& f) { edit(f / "config.toml", "[sky]\n", "[sky]\nimge = 1\n"); },
       {"config.toml", "imge", "image", "2"}},
      {"config_is_no_toml",
       program,
       "config.toml",
       [](auto& f) { spill(f / "config.toml", "[sky\n"); },
       {"config.toml"}},
      {"missing_photograph", program, "config.toml", [](auto& f) { fs::remove(f / "photo.exr"); }, {"photo.exr"}},
      {"missing_object", program, "config.toml", [](auto& f) { fs::remove(f / "cube.obj"); }, {"cube.obj"}},
      {"lens_of_another_size",
       program,
       "config.toml",
       [](auto& f) { edit(f / "lens.yaml", "image_width: 64", "image_width: 65"); },
       {"65"}},
      {"output_size_of_another_shape",
       program,
       "config.toml",
       [](auto& f) { edit(f / "config.toml", "[output]\n", "[output]\nsize = [640, 64]\n"); },
       {"[output] size", "640 x 64", "stretch"}},
      {"no_marker_in_the_picture",
       program,
       "config.toml",
       [](auto& f) {
         edit(f / "config.toml", "[pose]\nposition = [1.0, 1.8, 1.0]\nlook_at = [1.0, 0.5, 0.2]\n",
              "[marker]\nids = [23]\nsize_m = 0.05\n");
       },
       {"no marker", "6X6_250", "23", "photo.exr"}},
  };
}

void check(const fs::path& root, const Case& c) {
  SCOPED_TRACE(c.name);
  const fs::path folder = root / c.name;
  fs::copy(root / "good", folder, fs::copy_options::recursive);
  c.spoil(folder);
  std::vector<std::string> before, after;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    before.push_back(entry.path().filename().string());
  const Outcome outcome = run_in(folder, std::string(c.program) + " " + c.arguments);
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  for (const std::string& part : c.said)
    EXPECT_NE(outcome.err.find(part), std::string::npos) << "no \"" << part << "\" in: " << outcome.err;
  EXPECT_EQ(outcome.err.find("internal"), std::string::npos) << outcome.err;
  const bool hint = outcome.err.find("; ") != std::string::npos ||
                    outcome.err.find("did you mean") != std::string::npos ||
                    outcome.err.find("expected") != std::string::npos;
  EXPECT_TRUE(hint) << "no hint in: " << outcome.err;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    after.push_back(entry.path().filename().string());
  EXPECT_EQ(after.size(), before.size()) << "a file was left behind";
  fs::remove_all(folder);
}

TEST_F(BadInput, good_input_succeeds) {
  // Otherwise the cases below would prove nothing.
  EXPECT_EQ(run_in(root_ / "good", "daylit-probe room.volume --sky sky.exr < points.txt").exit_code, 0);
  EXPECT_EQ(run_in(root_ / "good", "daylit-precompute check room.obj").exit_code, 0);
  if (has_program("daylit-run")) {
    const Outcome outcome = run_in(root_ / "good", "daylit-run config.toml --quiet");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    fs::remove(root_ / "good/out.png");
    fs::remove(root_ / "good/out.exr");
  }
}

TEST_F(BadInput, rooms_are_refused_with_what_where_and_hint) {
  for (const Case& c : room_cases())
    check(root_, c);
}

TEST_F(BadInput, skies_and_volumes_are_refused_with_what_where_and_hint) {
  for (const Case& c : sky_and_volume_cases())
    check(root_, c);
}

TEST_F(BadInput, run_configurations_are_refused_with_what_where_and_hint) {
  if (!has_program("daylit-run"))
    GTEST_SKIP() << "this build has no daylit-run";
  for (const Case& c : run_cases())
    check(root_, c);
}

TEST_F(BadInput, a_replay_without_a_recording_is_refused_and_writes_nothing) {
  if (!has_program("daylit-run"))
    GTEST_SKIP() << "this build has no daylit-run";
  EXPECT_EQ(run_in(root_ / "good", "daylit-run config.toml --replay").exit_code, 2);
  EXPECT_EQ(run_in(root_ / "good", "daylit-run config.toml --replay nowhere").exit_code, 2);
  const Outcome outcome = run_in(root_ / "good", "daylit-run config.toml --replay .");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
  EXPECT_NE(outcome.err.find("interior/frames.jsonl"), std::string::npos) << outcome.err;
  EXPECT_FALSE(fs::exists(root_ / "good/out.png"));
}

TEST_F(BadInput, faces_without_area_and_duplicates_are_dropped_and_named) {
  const fs::path folder = root_ / "faces";
  fs::copy(root_ / "good", folder, fs::copy_options::recursive);
  edit(folder / "room.obj", "usemtl window", "f 1 2 2\nf 1 2 3 4\nf 4 3 2 1\nusemtl window");
  const Outcome found = run_in(folder, "daylit-precompute check room.obj");
  EXPECT_EQ(found.exit_code, 0);
  EXPECT_NE(found.out.find("1 without area, 2 duplicate"), std::string::npos) << found.out << found.err;
  const Outcome baked =
      run_in(folder, "daylit-precompute room.obj -o bad.volume --quality draft --grid 4,4,4 --drop-bad-faces");
  EXPECT_EQ(baked.exit_code, 0);
  for (const char* part : {"1 faces without area dropped: line", "2 duplicate faces dropped", "as line"})
    EXPECT_NE(baked.err.find(part), std::string::npos) << baked.err;
}

TEST_F(BadInput, the_same_face_of_two_materials_stops_check_and_bake) {
  const fs::path folder = root_ / "two_materials";
  fs::copy(root_ / "good", folder, fs::copy_options::recursive);
  edit(folder / "room.obj", "usemtl window", "f 1 2 3 4\nusemtl window\nf 1 2 3 4");
  for (const char* command : {"daylit-precompute check room.obj", "daylit-precompute room.obj -o bad.volume"}) {
    const Outcome outcome = run_in(folder, command);
    EXPECT_EQ(outcome.exit_code, 1);
    for (const char* part : {"the same face twice", "room.obj, line", "\"window\""})
      EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err;
  }
  EXPECT_FALSE(fs::exists(folder / "bad.volume"));
}

TEST_F(BadInput, json_reports_the_error_on_stdout_too) {
  const Outcome outcome = run_in(root_ / "good", "daylit-precompute no.obj -o out.volume --json");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.out.rfind("{\"error\":", 0), 0u) << outcome.out;
}

TEST_F(BadInput, the_report_of_a_room_that_cannot_be_baked_is_one_json_object) {
  const fs::path folder = root_ / "closed";
  fs::copy(root_ / "good", folder, fs::copy_options::recursive);
  edit(folder / "room.obj", "usemtl window", "usemtl wall");
  const Outcome outcome = run_in(folder, "daylit-precompute check room.obj --json");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("window"), std::string::npos) << outcome.err;
  const auto report = nlohmann::json::parse(outcome.out, nullptr, false);
  ASSERT_FALSE(report.is_discarded()) << outcome.out;
  EXPECT_EQ(report["can_be_baked"], false);
}

TEST_F(BadInput, wrong_arguments_are_usage_errors) {
  EXPECT_EQ(run_in(root_ / "good", "daylit-precompute").exit_code, 2);
  EXPECT_EQ(run_in(root_ / "good", "daylit-precompute room.obj -o out.volume --regions uniform:7").exit_code, 2);
  EXPECT_EQ(run_in(root_ / "good", "daylit-precompute room.obj -o out.volume --quality best").exit_code, 2);
  EXPECT_EQ(run_in(root_ / "good", "daylit-probe room.volume --sky sky.exr --projection cube < points.txt").exit_code,
            2);
  EXPECT_FALSE(fs::exists(root_ / "good/out.volume"));
}

} // namespace
} // namespace daylit
