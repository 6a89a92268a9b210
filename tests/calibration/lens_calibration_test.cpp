// Lenses from boards: known lenses found again, wrong pictures named, verdicts in plain words.

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "calibration/lens_calibration.h"
#include "tests/calibration/board_case.h"

namespace daylit::calibration {
namespace {

using test::angle_error;
using test::circle_of;
using test::fisheye_views;
using test::go_on;
using test::kBoard;
using test::kDegree;
using test::kSquare_m;

TEST(FisheyeCalibration, lens_without_noise_is_found_exactly_and_its_field_is_the_circle) {
  const LensModel truth = test::true_fisheye();
  const ImageCircle circle = circle_of(truth, 95 * kDegree);
  std::mt19937 random(3);
  const auto found = calibrate_views(LensKind::equidistant, kBoard, truth.width_px, truth.height_px, circle,
                                     fisheye_views(random, 0.0, false), {}, go_on);
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_LT(found->fit.rms_px, 1e-4);
  EXPECT_LT(angle_error(found->fit.lens, truth, circle, 0.99), 0.002);
  EXPECT_NEAR(found->fit.lens.max_theta / kDegree, 95.0, 0.1);
}

std::vector<BoardView> camera_views(int count, double tilt, std::mt19937& random,
                                    const LensModel& lens = test::true_camera()) {
  const auto board = board_points(kBoard.columns, kBoard.rows, kSquare_m);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  std::vector<BoardView> views;
  while (static_cast<int>(views.size()) < count) {
    std::vector<glm::dvec2> corners;
    const auto pose =
        test::board_at(board, 18 * kDegree * u(random) * (tilt > 0.1 ? 1.0 : 0.05), 6.28 * u(random),
                       0.45 + 0.15 * u(random), tilt * (0.4 + 0.6 * u(random)), tilt > 0.1 ? 6.28 * u(random) : 0.0);
    if (test::look(lens, pose, board, 0.1, random, corners))
      views.push_back({"view" + std::to_string(views.size()), corners, board});
  }
  return views;
}

/// Ten views through an ideal fish-eye of this curve.
std::vector<BoardView> ideal_views(const std::array<double, 8>& curve, double widest_deg = 50) {
  LensModel lens = test::true_fisheye();
  lens.distortion = curve;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  const auto board = board_points(kBoard.columns, kBoard.rows, test::kSquare_m);
  std::vector<BoardView> views;
  while (views.size() < 10) {
    std::vector<glm::dvec2> corners;
    const auto pose = test::board_at(board, (views.empty() ? 5 : widest_deg * u(random)) * kDegree, 6.28 * u(random),
                                     0.27, (15 + 20 * u(random)) * kDegree, 6.28 * u(random));
    if (test::look(lens, pose, board, 0.1, random, corners))
      views.push_back({"view" + std::to_string(views.size()), corners, board});
  }
  return views;
}

TEST(FisheyeCalibration, an_ideal_curve_is_recognised_and_taken_without_coefficients) {
  const std::array<double, 8> equisolid{-1.0 / 24, 1.0 / 1920, -1.0 / 322560, 1.0 / 92897280}; // 2 sin(t / 2)
  for (const auto& [name, curve] : {std::pair{"equidistant", std::array<double, 8>{}}, {"equisolid", equisolid}}) {
    const LensModel truth = test::true_fisheye();
    const auto found = calibrate_views(LensKind::equidistant, kBoard, truth.width_px, truth.height_px, {},
                                       ideal_views(curve), {}, go_on);
    ASSERT_TRUE(found) << found.error().message();
    ASSERT_EQ(found->curves.size(), 3u);
    EXPECT_EQ(found->curves.front().name, name);
    EXPECT_LT(found->curves.front().held_out_rms_px, 0.16) << "noise of 0.1 px in each direction, twice";
    EXPECT_EQ(found->fit.lens.distortion, curve);
    EXPECT_NEAR(found->fit.lens.fx, truth.fx, 4 * found->fit.sigma[0]);
    for (const TriedCurve& other : found->curves)
      if (other.name != name && other.name != "polynomial") {
        EXPECT_GT(other.held_out_rms_px, 0.5) << other.name << " for " << name;
      }
  }
}

TEST(CameraCalibration, lens_is_found_and_the_verdict_is_pass) {
  std::mt19937 random(5);
  const LensModel truth = test::true_camera();
  const auto found = calibrate_views(LensKind::pinhole, kBoard, truth.width_px, truth.height_px, {},
                                     camera_views(14, 0.7, random), {}, go_on);
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_TRUE(found->pass) << found->why[0];
  EXPECT_NEAR(found->fit.lens.fx, truth.fx, 4 * found->fit.sigma[0]);
  EXPECT_NEAR(found->fit.lens.cy, truth.cy, 4 * found->fit.sigma[3]);
  EXPECT_LT(angle_error(found->fit.lens, truth, {{640, 480}, 480}, 0.9), 0.05);
  EXPECT_LT(found->held_out_rms_px, 1.3 * found->fit.rms_px);
}

LensCalibration camera_of(std::vector<BoardView> views) {
  const LensModel truth = test::true_camera();
  auto found =
      calibrate_views(LensKind::pinhole, kBoard, truth.width_px, truth.height_px, {}, std::move(views), {}, go_on);
  EXPECT_TRUE(found);
  return std::move(*found);
}

TEST(CameraCalibration, pixels_or_a_print_longer_one_way_are_said_and_pixels_of_another_shape_are_not) {
  for (const auto& [stretch, said] :
       {std::pair{1.0, ""}, {1.01, "1.0 % longer across"}, {1.0 / 1.01, "bottom"}, {1.2, ""}}) {
    std::mt19937 random(6);
    LensModel lens = test::true_camera();
    lens.fx = stretch * lens.fy;
    const LensCalibration found = camera_of(camera_views(14, 0.7, random, lens));
    EXPECT_EQ(found.pass, std::string(said).empty()) << stretch << " " << found.why[0];
    EXPECT_NE(found.why[0].find(said), std::string::npos) << found.why[0];
  }
}

TEST(CameraCalibration, pictures_of_two_lenses_are_said) {
  std::mt19937 random(8);
  const LensCalibration clean = camera_of(camera_views(14, 0.7, random));
  EXPECT_NEAR(clean.agreement.f, 1.0, 0.6) << "F(39, 2889): deviation 0.23";
  LensModel other = test::true_camera();
  other.cx -= 25;
  other.cy += 15;
  auto views = camera_views(7, 0.7, random);
  for (BoardView& view : camera_views(7, 0.7, random, other))
    views.push_back(std::move(view));
  const LensCalibration mixed = camera_of(views);
  EXPECT_GT(mixed.agreement.f, 30.0);
  EXPECT_GT(mixed.agreement.two, 0.65);
  EXPECT_FALSE(mixed.pass);
  EXPECT_NE(mixed.why[0].find("do not agree on one lens"), std::string::npos) << mixed.why[0];
}

TEST(CameraCalibration, pictures_of_a_fish_eye_are_told_the_way) {
  const LensCalibration found = camera_of(ideal_views({}, 60));
  EXPECT_FALSE(found.pass);
  bool told = false;
  for (const std::string& why : found.why)
    told = told || why.find("daylit-calibrate fisheye") != std::string::npos;
  EXPECT_TRUE(told) << found.why[0];
}

/// A print before a fish-eye: its axes, and its corner, 50 mm and 50 mm from the first inner corner of the board.
struct PrintPose {
  glm::dvec3 x, y, corner;
};

/// Eight of a board, two of one whose squares are 8 % wider than high; all upright, so that part of it may be the lens.
const std::vector<PrintPose> kUpright = {
    {{0.9703, 0.02005, 0.2411}, {0.06174, 0.943, -0.3269}, {-0.1795, -0.1471, 0.1997}},
    {{0.9635, -0.2198, 0.1526}, {0.2644, 0.8704, -0.4153}, {-0.2947, -0.008222, 0.2016}},
    {{0.9873, -0.1432, 0.06913}, {0.08289, 0.8345, 0.5447}, {-0.1718, -0.2469, 0.02108}},
    {{0.9574, 0.1869, -0.2202}, {-0.2796, 0.7906, -0.5448}, {-0.07835, -0.0003283, 0.2304}},
    {{0.983, -0.1674, 0.07594}, {0.09756, 0.8253, 0.5562}, {-0.2174, -0.253, -0.01635}},
    {{0.99, 0.02162, -0.1391}, {-0.09487, 0.8325, -0.5458}, {-0.1893, 0.04558, 0.2177}},
    {{0.9942, -0.08868, -0.06051}, {0.1072, 0.7939, 0.5985}, {-0.1867, -0.2808, 0.004774}},
    {{0.9988, 0.04737, 0.008481}, {-0.0436, 0.8161, 0.5762}, {-0.1834, -0.2867, -0.0149}},
    {{0.6547, -0.09666, -0.7496}, {0.1706, 0.9851, 0.02195}, {-0.07055, -0.09819, 0.2831}},
    {{0.972, -0.0257, 0.2334}, {-0.1074, 0.8352, 0.5394}, {-0.2635, -0.2549, -0.01254}}};

std::vector<BoardView> upright_views(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, 0.2);
  std::vector<BoardView> views;
  for (const PrintPose& pose : kUpright) {
    const bool wrong = views.size() >= 8;
    BoardView view{(wrong ? "wrong" : "good") + std::to_string(views.size()),
                   {},
                   board_points(kBoard.columns, kBoard.rows, kSquare_m)};
    for (const glm::dvec3& p : view.board_m) {
      const auto px = test::true_fisheye().project(pose.corner + (p.x + 0.05) * pose.x +
                                                   (p.y + 0.05) / (wrong ? 1.08 : 1.0) * pose.y);
      view.corner_px.push_back(px.value() + glm::dvec2(noise(random), noise(random)));
    }
    views.push_back(std::move(view));
  }
  return views;
}

TEST(FisheyeCalibration, views_that_spoil_the_fit_of_all_others_are_named) {
  const LensModel truth = test::true_fisheye();
  for (unsigned seed = 1; seed <= 2; ++seed) {
    const auto found = calibrate_views(LensKind::equidistant, kBoard, truth.width_px, truth.height_px,
                                       circle_of(truth, 95 * kDegree), upright_views(seed), {}, go_on);
    ASSERT_TRUE(found) << found.error().message();
    EXPECT_EQ(found->dropped.size(), 2u) << "seed " << seed;
    for (const DroppedPicture& d : found->dropped)
      EXPECT_TRUE(d.file.starts_with("wrong")) << d.file << ": " << d.why;
    EXPECT_LT(found->fit.rms_px, 0.35) << "seed " << seed;
  }
}

bool says(const std::vector<std::string>& why, const char* what) {
  return std::ranges::any_of(why, [&](const std::string& w) { return w.find(what) != std::string::npos; });
}

TEST(CameraCalibration, verdict_says_what_is_wrong) {
  std::mt19937 random(6);
  const LensModel truth = test::true_camera();
  const auto sitting = [&](std::vector<BoardView> views) {
    return calibrate_views(LensKind::pinhole, kBoard, truth.width_px, truth.height_px, {}, std::move(views),
                           {{"dark.png", "too dark"}}, go_on);
  };
  const auto alike = sitting(camera_views(10, 0.02, random)), few = sitting(camera_views(4, 0.7, random));
  ASSERT_TRUE(alike) << alike.error().message();
  ASSERT_TRUE(few) << few.error().message();
  EXPECT_FALSE(alike->pass);
  EXPECT_TRUE(says(alike->why, "alike")) << alike->why[0];
  EXPECT_FALSE(says(alike->why, "longer")) << "alike views cannot tell pixels from tilt";
  EXPECT_FALSE(few->pass);
  EXPECT_TRUE(says(few->why, "only 4 pictures")) << few->why[0];
  const auto too_few = sitting(camera_views(2, 0.7, random));
  ASSERT_TRUE(too_few);
  EXPECT_FALSE(too_few->pass);
  EXPECT_TRUE(too_few->views.empty());
  EXPECT_TRUE(says(too_few->why, "fewer than three"));
  EXPECT_TRUE(says(too_few->why, "too dark"));
  const auto stopped =
      calibrate_views(LensKind::pinhole, kBoard, truth.width_px, truth.height_px, {}, camera_views(5, 0.7, random), {},
                      [](const std::string&, double) { return false; });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::interrupted);
}

TEST(CameraCalibration, report_is_one_page_and_one_object) {
  std::mt19937 random(7);
  const LensModel truth = test::true_camera();
  const auto found = calibrate_views(LensKind::pinhole, kBoard, truth.width_px, truth.height_px, {},
                                     camera_views(8, 0.7, random), {{"<b>.png", "blurred"}}, go_on);
  ASSERT_TRUE(found);
  const auto j = nlohmann::json::parse(to_json(report_of(*found)));
  EXPECT_EQ(j["used"].size(), 8u);
  EXPECT_EQ(j["dropped"][0]["file"], "<b>.png");
  EXPECT_TRUE(j.contains("verdict") && j.contains("rms_px") && j.contains("held_out_rms_px") && j.contains("why"));
  const std::string page = to_html(report_of(*found), "daylit-calibrate camera");
  EXPECT_EQ(page.find("<b>.png"), std::string::npos) << "names are escaped";
  EXPECT_EQ(page.find("http"), std::string::npos) << "nothing is loaded from elsewhere";
}

/// Real photographs: what OpenCV's own fit reaches on them, and how many of them.
void expect_on_photographs(const char* folder, LensKind kind, BoardSize board, double square_m, double rms_px,
                           std::size_t at_least) {
  const auto data = std::filesystem::path(DAYLIT_SOURCE_DIR) / "../shared/data" / folder;
  if (!std::filesystem::exists(data))
    GTEST_SKIP() << "the shared photographs are not here";
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(data))
    if (entry.path().extension() == ".jpg")
      files.push_back(entry.path());
  std::ranges::sort(files);
  const auto found = calibrate_lens(
      kind, Target{board, square_m}, files.size(),
      [&](std::size_t i) -> Result<BoardPicture> {
        auto picture = read_ldr_image(files[i]);
        if (!picture)
          return picture.error();
        return BoardPicture{files[i].filename().string(), std::move(*picture)};
      },
      go_on);
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_TRUE(found->pass) << found->why[0];
  EXPECT_GE(found->views.size(), at_least);
  EXPECT_LE(found->fit.rms_px, rms_px);
  EXPECT_LE(found->held_out_rms_px, 1.3 * found->fit.rms_px);
}

TEST(LensCalibration, photographs_of_a_fisheye_give_what_is_known_of_it) {
  expect_on_photographs("fisheye-calib", LensKind::equidistant, {6, 8}, 0.0325, 0.5, 13);
}

TEST(LensCalibration, photographs_of_an_ordinary_camera_give_what_is_known_of_it) {
  expect_on_photographs("chessboard", LensKind::pinhole, {9, 6}, 0.025, 0.2, 12);
}

} // namespace
} // namespace daylit::calibration
