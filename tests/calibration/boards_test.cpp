// Boards from the printer to the verdict, through the programs' own command lines.

#include <gtest/gtest.h>

#include "calibration/charuco.h"
#include "calibration/lens_fit.h"
#include "tests/calibration/calibrate_program.h"

namespace daylit {
namespace {

namespace fs = std::filesystem;
using test::says;

constexpr const char* kCamera = "image_width: 640\nimage_height: 480\ncamera_matrix: {rows: 3, cols: 3, data: [520, 0, "
                                "322.5, 0, 521, 237, 0, 0, 1]}\n"
                                "distortion_model: plumb_bob\ndistortion_coefficients: {rows: 1, cols: 5, data: [-0.2, "
                                "0.06, 0.0005, -0.0003, 0]}\n";
constexpr const char* kFisheye = "image_width: 800\nimage_height: 720\ncamera_matrix: {rows: 3, cols: 3, data: [205, "
                                 "0, 396, 0, 204.8, 362, 0, 0, 1]}\n"
                                 "distortion_model: equidistant\ndistortion_coefficients: {rows: 1, cols: 4, data: "
                                 "[-0.012, 0.006, -0.003, 0.0005]}\n"
                                 "max_theta_deg: 95\n";
constexpr const char* kMarkers = " --dictionary 6X6_250 --marker 0.022";

bool runs(const fs::path& folder, const std::string& line) {
  return std::system(
             ("cd '" + folder.string() + "' && " DAYLIT_BINARY_DIR "/bin/" + line + " > /dev/null 2> stderr.txt")
                 .c_str()) == 0;
}

/// A folder with both lenses, and a board of 9 x 6 inner corners of 30 mm.
fs::path sitting(const std::string& name, const std::string& markers) {
  const fs::path folder = test::fresh_folder(name);
  std::ofstream(folder / "camera.yaml") << kCamera;
  std::ofstream(folder / "fisheye.yaml") << kFisheye;
  EXPECT_TRUE(runs(folder, "daylit-calibrate print --board 9x6 --square 0.03 -o board.png" + markers));
  return folder;
}

bool photographs(const fs::path& folder, const std::string& options) {
  return runs(folder, "daylit-simulate photographs board.png --width 0.36 -o p --format png --quiet " + options);
}

test::CalibrateOutcome lens(const fs::path& folder, const std::string& arguments) {
  return test::calibrate(folder, arguments + " p/*.png -o found.yaml --force");
}

double of_lens(const test::CalibrateOutcome& outcome, const char* name, const char* what) {
  return outcome.json["lens"][name][what].get<double>();
}

TEST(CharucoBoard, a_fisheye_is_calibrated_to_its_edge_by_parts_of_the_board) {
  const fs::path folder = sitting("charuco-fisheye", kMarkers);
  ASSERT_TRUE(photographs(folder, "--lens fisheye.yaml --views 10 --partly --reach 1 --part 0.7"));
  const auto found = lens(folder, "fisheye --board 9x6 --square 0.03" + std::string(kMarkers));
  ASSERT_EQ(found.exit_code, 0);
  EXPECT_EQ(found.json["verdict"], "pass") << found.json;
  EXPECT_GE(found.json["used"].size(), 8u);
  EXPECT_GT(found.json["reach_deg"], 90.0);
  EXPECT_LT(found.json["rms_px"], 0.25);
  EXPECT_NEAR(of_lens(found, "fx", "value"), 205.0, 4 * of_lens(found, "fx", "sigma"));
  EXPECT_NEAR(of_lens(found, "cx", "value"), 396.0, 4 * of_lens(found, "cx", "sigma"));
}

TEST(CharucoBoard, what_is_stated_wrongly_is_said) {
  const fs::path folder = sitting("charuco-wrong", kMarkers);
  ASSERT_TRUE(photographs(folder, "--lens camera.yaml --views 4"));
  const auto stated = [&](const std::string& options) { return lens(folder, "camera --square 0.03 " + options); };
  EXPECT_EQ(stated("--board 9x6" + std::string(kMarkers)).json["used"].size(), 4u);
  EXPECT_TRUE(says(stated("--board 8x6" + std::string(kMarkers)), "the board size is wrong"));
  EXPECT_TRUE(says(stated("--board 8x6" + std::string(kMarkers)), "9 inner corners in a row, not 8"));
  EXPECT_TRUE(says(stated("--board 9x4" + std::string(kMarkers)), "more rows"));
  EXPECT_TRUE(says(stated("--board 9x6 --dictionary 6X6_250 --marker 0.015"),
                   "times as wide as its markers, --square and --marker say 2.00"));
  EXPECT_TRUE(says(stated("--board 9x6 --dictionary 5X5_100 --marker 0.022"), "markers of the dictionary 6X6"));
  EXPECT_EQ(stated("--board 9x6 --dictionary 6X6_250").exit_code, 2) << "a dictionary without a marker's side";
}

TEST(CharucoBoard, ids_go_row_by_row_through_the_white_squares) {
  using calibration::square_of_marker;
  EXPECT_EQ(square_of_marker(0, 10, true), glm::ivec2(1, 0));
  EXPECT_EQ(square_of_marker(4, 10, true), glm::ivec2(9, 0));
  EXPECT_EQ(square_of_marker(5, 10, true), glm::ivec2(0, 1));
  EXPECT_EQ(square_of_marker(0, 5, false), glm::ivec2(0, 0));
  EXPECT_EQ(square_of_marker(3, 5, false), glm::ivec2(1, 1));
  EXPECT_EQ(square_of_marker(2, 5, true), glm::ivec2(0, 1));
  EXPECT_EQ(square_of_marker(5, 5, true), glm::ivec2(1, 2));
}

struct Failure {
  const char *name, *photographs, *verdict;
};
void PrintTo(const Failure& f, std::ostream* out) { *out << f.name; }
class SittingThatFails : public testing::TestWithParam<Failure> {};

TEST_P(SittingThatFails, is_told_why) {
  const fs::path folder = sitting(std::string("sitting-") + GetParam().name, "");
  ASSERT_TRUE(photographs(folder, std::string("--lens camera.yaml --views 6 ") + GetParam().photographs));
  const auto found = lens(folder, "camera --board 9x6 --square 0.03");
  EXPECT_EQ(found.json["verdict"], "repeat");
  EXPECT_TRUE(says(found, GetParam().verdict)) << found.json["why"];
}

INSTANTIATE_TEST_SUITE_P(
    Boards, SittingThatFails,
    testing::Values(Failure{"blurred", "--blur 9", "6 of 6 pictures: blurred"},
                    Failure{"noisy", "--blur 9 --noise 0.03", "6 of 6 pictures: blurred"},
                    Failure{"white", "--exposure 60", "6 of 6 pictures: over-exposed"},
                    Failure{"bright", "--exposure 3",
                            "over-exposed: the white of the board is at the top of the range in 6 of 6"},
                    Failure{"dark", "--exposure 0.0001 --noise 0", "6 of 6 pictures: too dark"},
                    Failure{"alike", "--tilt 3 --reach 0.1", "all pictures are alike"}));

TEST(Checkerboard, a_picture_that_is_over_exposed_or_damaged_is_named_and_does_no_harm) {
  const fs::path folder = sitting("one-bright", "");
  ASSERT_TRUE(photographs(folder, "--lens camera.yaml --views 1 --exposure 4"));
  fs::rename(folder / "p/photograph-00.png", folder / "p/bright.png");
  ASSERT_TRUE(photographs(folder, "--lens camera.yaml --views 12 --seed 5"));
  const auto found = lens(folder, "camera --board 9x6 --square 0.03");
  EXPECT_EQ(found.json["verdict"], "pass") << found.json["why"];
  EXPECT_EQ(found.json["used"].size(), 13u);
  EXPECT_TRUE(says(found, "over-exposed, though in use: bright.png\"")) << found.json["why"];
  std::ofstream(folder / "p/damaged.png") << "no picture";
  const auto damaged = lens(folder, "camera --board 9x6 --square 0.03");
  EXPECT_EQ(damaged.json["used"].size(), 13u);
  ASSERT_EQ(damaged.json["dropped"].size(), 1u);
  EXPECT_EQ(damaged.json["dropped"][0]["file"], "damaged.png");
}

TEST(Checkerboard, a_wrong_size_and_two_boards_are_told_apart) {
  const fs::path folder = sitting("two-boards", "");
  ASSERT_TRUE(photographs(folder, "--lens camera.yaml --views 6"));
  const auto wrong = lens(folder, "camera --board 8x5 --square 0.03");
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_TRUE(says(wrong, "the board size is wrong: 6 of 6 pictures: shows a board of 9 x 6")) << wrong.json["why"];
  ASSERT_TRUE(runs(folder, "daylit-calibrate print --board 7x5 --square 0.03 -o other.png"));
  ASSERT_TRUE(runs(folder, "daylit-simulate photographs other.png --width 0.3 --lens camera.yaml -o q --views 3 "
                           "--format png --quiet"));
  for (int k = 0; k < 3; ++k)
    fs::rename(folder / ("q/photograph-0" + std::to_string(k) + ".png"), folder / ("p/q" + std::to_string(k) + ".png"));
  const auto mixed = lens(folder, "camera --board 9x6 --square 0.03");
  EXPECT_EQ(mixed.json["verdict"], "repeat");
  EXPECT_TRUE(says(mixed, "two boards are mixed, keep one; 3 of 9 pictures: shows a board of 7 x 5"))
      << mixed.json["why"];
}

} // namespace
} // namespace daylit
