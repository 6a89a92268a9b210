// Orientation of a fish-eye camera from a marker board anywhere in its field.

#include <fstream>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>

#include "calibration/fisheye_board.h"
#include "calibration/orientation_fit.h"
#include "simulate/board_picture.h"
#include "tests/calibration/calibrate_program.h"

namespace daylit::calibration {
namespace {

namespace fs = std::filesystem;

constexpr double kDegree = std::numbers::pi / 180.0;

/// A board of 3 x 2 markers, 0.16 m each, and a fish-eye of 1000 pixels that has it `off_axis` degrees from its axis.
struct BoardScene {
  LensModel lens = ideal_fisheye(1000, 1000, 190 * kDegree);
  PrintedBoard board;
  glm::dmat4 world_from_board{1.0}, world_from_camera{1.0};
  std::mt19937 random;

  BoardScene(double off_axis_deg, double distance_m, unsigned seed)
      : board(*PrintedBoard::print(*BoardLayout::grid("6X6_250", {4, 5, 6, 7, 8, 9}, 3, 0.16, 0.04), 0.04)),
        random(seed) {
    std::uniform_real_distribution<double> u(-1.0, 1.0);
    const glm::dquat any = glm::angleAxis(3.0 * u(random), glm::normalize(glm::dvec3(u(random), u(random), u(random))));
    const double phi = std::numbers::pi * u(random);
    const glm::dvec3 towards(std::sin(off_axis_deg * kDegree) * std::cos(phi),
                             std::sin(off_axis_deg * kDegree) * std::sin(phi), std::cos(off_axis_deg * kDegree));
    world_from_camera = glm::dmat4(glm::mat3_cast(any));
    world_from_camera[3] = glm::dvec4(1.0 + u(random), u(random), 1.5, 1.0);
    // Faces the camera, tilted by 30 degrees.
    const glm::dvec3 z = glm::mat3_cast(any) * -towards;
    const glm::dvec3 x = glm::normalize(glm::cross(glm::dvec3(0.3, 0.5, 0.8), z));
    const glm::dmat3 facing(x, glm::cross(z, x), z);
    const glm::dmat3 tilted =
        facing * glm::mat3_cast(glm::angleAxis(0.5, glm::normalize(glm::dvec3(u(random), u(random), 0))));
    world_from_board = glm::dmat4(tilted);
    world_from_board[3] = glm::dvec4(glm::dvec3(world_from_camera[3]) - distance_m * z, 1.0);
  }

  /// 9 samples per pixel, 1 % noise.
  RgbImage picture() {
    RgbImage image(lens.width_px, lens.height_px);
    std::normal_distribution<double> noise(1.0, 0.01);
    const glm::dmat4 board_from_camera = glm::inverse(world_from_board) * world_from_camera;
    const glm::dvec3 eye(board_from_camera[3]);
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        double sum = 0;
        for (int k = 0; k < 9; ++k)
          if (const auto d = lens.unproject({x + (k % 3 - 1) / 3.0, y + (k / 3 - 1) / 3.0})) {
            const glm::dvec3 ray = glm::dmat3(board_from_camera) * *d;
            const double t = -eye.z / ray.z;
            sum += t > 0 && eye.z > 0 ? board.at(eye.x + t * ray.x, eye.y + t * ray.y) : board.wall;
          }
        image.at(x, y) = Rgb(static_cast<float>(sum / 9 * noise(random)));
      }
    return image;
  }
};

TEST(AlignBoard, the_turn_is_right_wherever_the_board_hangs) {
  for (const double off_axis : {10.0, 50.0, 75.0}) {
    BoardScene scene(off_axis, 1.0, static_cast<unsigned>(off_axis));
    const auto found = locate_board(scene.picture(), scene.lens, scene.board.layout, scene.world_from_board);
    ASSERT_TRUE(found) << off_axis << ": " << found.error().message();
    EXPECT_EQ(found->ids.size(), 6u) << off_axis;
    const double error = turn_between(glm::dmat3(found->world_from_camera), glm::dmat3(scene.world_from_camera));
    EXPECT_LT(error, 0.2) << off_axis;
    EXPECT_LT(error, 4 * found->sigma_deg) << off_axis << ": the stated uncertainty";
    EXPECT_LT(found->sigma_deg, 0.3) << off_axis;
    EXPECT_LT(glm::distance(glm::dvec3(found->world_from_camera[3]), glm::dvec3(scene.world_from_camera[3])),
              4 * found->sigma_m)
        << off_axis;
  }
}

TEST(AlignBoard, a_picture_without_the_board_says_so) {
  BoardScene scene(20.0, 1.0, 3);
  auto other = scene.board.layout;
  for (PlacedMarker& m : other.markers)
    m.id += 20;
  const auto none = locate_board(scene.picture(), scene.lens, other, scene.world_from_board);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message().find("6 other markers"), std::string::npos) << none.error().message();
}

std::string marker_toml(const glm::dmat4& m, double size_m) {
  std::ostringstream out;
  out.precision(12);
  out << "[marker]\nids = [4, 5, 6, 7, 8, 9]\ncolumns = 3\ngap_m = 0.04\nsize_m = " << size_m
      << "\nworld_from_board = [";
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c)
      out << m[c][r] << (r == 3 && c == 3 ? "]\n" : ", ");
  return out.str();
}

TEST(AlignBoardProgram, writes_the_lens_and_knows_more_where_the_position_is_given) {
  const fs::path folder = test::fresh_folder("align-board");
  BoardScene scene(60.0, 1.4, 11);
  ASSERT_TRUE(write_lens(folder / "lens.yaml", scene.lens));
  ASSERT_TRUE(write_exr(folder / "a.exr", scene.picture()));
  ASSERT_TRUE(write_exr(folder / "empty.exr", RgbImage(1000, 1000, Rgb(0.3f))));
  std::ofstream(folder / "board.toml") << marker_toml(scene.world_from_board, 0.16);
  std::ofstream(folder / "wrong.toml") << marker_toml(scene.world_from_board, 0.12);
  const std::string align = "align a.exr --lens lens.yaml --board ", position = [&] {
    std::ostringstream out;
    out << " --position " << scene.world_from_camera[3].x << "," << scene.world_from_camera[3].y << ","
        << scene.world_from_camera[3].z;
    return out.str();
  }();
  const auto error = [&](const std::string& file) {
    const auto lens = read_lens(folder / file);
    EXPECT_TRUE(lens);
    return lens ? turn_between(lens->world_from_camera, glm::dmat3(scene.world_from_camera)) : 180.0;
  };
  const auto found = test::calibrate(folder, align + "board.toml -o one.yaml --report out");
  EXPECT_EQ(found.exit_code, 0) << found.json;
  EXPECT_LT(error("one.yaml"), 0.25);
  const auto better = test::calibrate(folder, align + "board.toml -o two.yaml" + position);
  EXPECT_EQ(better.json.value("verdict", ""), "pass") << better.json;
  EXPECT_LT(error("two.yaml"), 0.05);
  EXPECT_LT(better.json.value("sigma_deg", 1.0), found.json.value("sigma_deg", 0.0));
  const auto wrong = test::calibrate(folder, align + "wrong.toml -o three.yaml" + position);
  EXPECT_EQ(wrong.json.value("verdict", ""), "repeat") << wrong.json;
  const auto empty = test::calibrate(folder, "align empty.exr --lens lens.yaml --board board.toml -o four.yaml");
  EXPECT_EQ(empty.exit_code, 1);
  EXPECT_TRUE(test::says(empty, "no marker is seen")) << empty.json;
}

} // namespace
} // namespace daylit::calibration
