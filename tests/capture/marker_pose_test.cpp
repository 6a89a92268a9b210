#include "capture/markers/find_markers.h"
#include "capture/markers/marker_pose.h"

#include <cmath>
#include <filesystem>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>
#include <gtest/gtest.h>

#include "scene/image/image_formats.h"
#include "simulate/board_picture.h"

namespace daylit {
namespace {

/// Without blur and noise: what the method itself leaves.
Rgb8Image clean_picture(const PrintedBoard& board, const LensModel& lens, const glm::dmat4& world_from_board,
                        const glm::dmat4& world_from_camera) {
  return BoardCamera(lens, {0.0, {}, 0.0}).picture(board, glm::inverse(world_from_camera) * world_from_board, 1);
}

/// White paper up to a fifth of the side around each marker.
Rgb8Image photograph_of(const BoardLayout& board, const LensModel& lens, const glm::dmat4& world_from_board,
                        const glm::dmat4& world_from_camera) {
  return clean_picture(*PrintedBoard::print(board, 0.2 * board.markers[0].side_m), lens, world_from_board,
                       world_from_camera);
}

/// Tag 0 of an AprilTag family as its authors print it: bits row by row from the top left, the first the highest,
/// 1 = white (Olson 2011; the picture tag36_11_00000.png and its like).
MarkerPrint april_tag(std::uint64_t code, int side) {
  MarkerPrint print{side + 2, std::vector<std::uint8_t>(static_cast<std::size_t>((side + 2) * (side + 2)), 0)};
  for (int k = 0; k < side * side; ++k)
    print.white[static_cast<std::size_t>((1 + k / side) * (side + 2) + 1 + k % side)] =
        code >> (side * side - 1 - k) & 1;
  return print;
}

glm::dmat4 look_at(const glm::dvec3& eye, const glm::dvec3& target, const glm::dvec3& up) {
  const glm::dvec3 z = glm::normalize(target - eye), x = glm::normalize(glm::cross(z, up)), y = glm::cross(z, x);
  return glm::dmat4(glm::dvec4(x, 0), glm::dvec4(y, 0), glm::dvec4(z, 0), glm::dvec4(eye, 1));
}

double rotation_error_deg(const glm::dmat4& a, const glm::dmat4& b) {
  const glm::dmat3 r = glm::transpose(glm::dmat3(a)) * glm::dmat3(b);
  return std::acos(std::min(1.0, 0.5 * (r[0][0] + r[1][1] + r[2][2] - 1))) * 180 / 3.14159265358979;
}

LensModel interior_lens() {
  LensModel lens = ideal_pinhole(480, 360, 0.95);
  lens.distortion = {0.0995, -0.2064, 0.0075, 0.0034, 0, 0, 0, 0};
  return lens;
}

/// A board on the wall x = 4 of a room: it faces -x, its right is +y ... seen from inside, up is +z.
glm::dmat4 board_on_wall() {
  return glm::dmat4(glm::dvec4(0, -1, 0, 0), glm::dvec4(0, 0, 1, 0), glm::dvec4(-1, 0, 0, 0), glm::dvec4(4, 2, 1.2, 1));
}

TEST(MarkerPose, opencv_corner_order_meets_our_board_frame) {
  // Print: top left first, clockwise. Board frame: x right, y up.
  const auto corners = board_corners({7, 0.2, {1.0, 2.0}});
  EXPECT_LT(glm::length(corners[0] - glm::dvec2(0.9, 2.1)), 1e-12);
  EXPECT_LT(glm::length(corners[1] - glm::dvec2(1.1, 2.1)), 1e-12);
  EXPECT_LT(glm::length(corners[2] - glm::dvec2(1.1, 1.9)), 1e-12);
  EXPECT_LT(glm::length(corners[3] - glm::dvec2(0.9, 1.9)), 1e-12);
}

TEST(MarkerPose, corners_are_found_to_a_few_hundredths_of_a_pixel) {
  const BoardLayout board = BoardLayout::single("6X6_250", 23, 0.12);
  const LensModel lens = interior_lens();
  const glm::dmat4 pose = look_at({3.2, 2.4, 1.5}, {4, 2, 1.2}, {0, 0, 1});
  const auto seen = find_markers(photograph_of(board, lens, board_on_wall(), pose), "6X6_250");
  ASSERT_TRUE(seen);
  ASSERT_EQ(seen->size(), 1u);
  const auto on_board = board_corners(board.markers[0]);
  for (std::size_t k = 0; k < 4; ++k) {
    const glm::dvec4 world = board_on_wall() * glm::dvec4(on_board[k], 0.0, 1.0);
    const auto expected = lens.project(glm::dvec3(glm::inverse(pose) * world));
    ASSERT_TRUE(expected);
    const double error = glm::length((*seen)[0].corner_px[k] - *expected);
    EXPECT_LT(error, 0.06) << k;
    RecordProperty("corner_error_px_" + std::to_string(k), std::to_string(error));
  }
}

TEST(MarkerPose, single_marker_gives_the_true_camera) {
  const BoardLayout board = BoardLayout::single("DICT_6X6_250", 23, 0.12);
  const glm::dmat4 true_pose = look_at({3.2, 2.4, 1.5}, {4, 2, 1.2}, {0, 0, 1});
  const auto photo = photograph_of(board, interior_lens(), board_on_wall(), true_pose);
  const auto pose = marker_pose(photo, interior_lens(), board, board_on_wall());
  ASSERT_TRUE(pose) << pose.error().message();
  EXPECT_LT(rotation_error_deg(pose->world_from_camera, true_pose), 0.5);
  EXPECT_LT(glm::length(glm::dvec3(pose->world_from_camera[3] - true_pose[3])), 0.006); // 0.9 m away
  EXPECT_LT(pose->reprojection_rms_px, 0.3);
  EXPECT_FALSE(pose->tilt_uncertain()); // an oblique view decides between the two solutions
  EXPECT_EQ(pose->ids_used, std::vector<int>{23});
  RecordProperty("rotation_error_deg", std::to_string(rotation_error_deg(pose->world_from_camera, true_pose)));
  RecordProperty("position_error_m",
                 std::to_string(glm::length(glm::dvec3(pose->world_from_camera[3] - true_pose[3]))));
}

TEST(MarkerPose, april_tags_are_upright_as_their_authors_print_them) {
  struct Family {
    const char* name;
    std::uint64_t code;
    int side;
  };
  const glm::dmat4 true_pose = look_at({3.2, 2.4, 1.5}, {4, 2, 1.2}, {0, 0, 1});
  for (const Family& f : {Family{"APRILTAG_16h5", 0x231b, 4}, Family{"APRILTAG_25h9", 0x155cbf1, 5},
                          Family{"APRILTAG_36h10", 0x1ca92a687, 6}, Family{"DICT_APRILTAG_36h11", 0xd5d628584, 6}}) {
    const BoardLayout board = BoardLayout::single(f.name, 0, 0.12);
    const auto photo =
        clean_picture({board, {april_tag(f.code, f.side)}, 0.024}, interior_lens(), board_on_wall(), true_pose);
    const auto pose = marker_pose(photo, interior_lens(), board, board_on_wall());
    ASSERT_TRUE(pose) << f.name << ": " << pose.error().message();
    EXPECT_LT(rotation_error_deg(pose->world_from_camera, true_pose), 0.5) << f.name;
  }
}

/// What a camera at `eye`, upright, sees of the marker's corners, each moved by `error_px` in turn.
MarkerPose pose_seen_from(const glm::dvec3& eye, double side_m, double error_px) {
  const BoardLayout board = BoardLayout::single("6X6_250", 23, side_m);
  const LensModel lens = ideal_pinhole(480, 360, 0.95);
  const glm::dmat4 camera_from_board = glm::inverse(look_at(eye, {4, 2, 1.2}, {0, 0, 1})) * board_on_wall();
  SeenMarker seen{23, {}};
  for (std::size_t k = 0; k < 4; ++k) {
    const glm::dvec2 on_board = board_corners(board.markers[0])[k];
    seen.corner_px[k] = *lens.project(glm::dvec3(camera_from_board * glm::dvec4(on_board, 0.0, 1.0))) +
                        glm::dvec2(k % 2 == 0 ? error_px : -error_px, k < 2 ? error_px : 0.0);
  }
  return *marker_pose({seen}, lens, board, board_on_wall());
}

TEST(MarkerPose, tilt_is_uncertain_only_where_two_different_poses_fit_equally_well) {
  EXPECT_TRUE(pose_seen_from({2.0, 2.8, 1.44}, 0.05, 0.1).tilt_uncertain()) << "small and far away";
  EXPECT_FALSE(pose_seen_from({3.2, 2.48, 1.344}, 0.12, 0.1).tilt_uncertain()) << "from the side";
  for (const double error_px : {0.0, 0.01, 0.1, 0.3}) { // all solutions end in the one pose there is
    const MarkerPose face_on = pose_seen_from({3.8, 2.0, 1.2}, 0.05, error_px);
    EXPECT_FALSE(face_on.tilt_uncertain()) << error_px;
    EXPECT_LE(face_on.reprojection_rms_px, error_px + 1e-6);
  }
}

TEST(MarkerPose, a_grid_is_solved_as_one_and_is_better_than_one_marker) {
  const BoardLayout board = *BoardLayout::grid("6X6_250", {0, 1, 2, 3, 4, 5}, 3, 0.08, 0.04);
  EXPECT_LT(glm::length(board.markers[0].centre_m - glm::dvec2(-0.12, 0.06)), 1e-12);
  const glm::dmat4 true_pose = look_at({3.1, 2.2, 1.4}, {4, 2, 1.2}, {0, 0, 1});
  const auto photo = photograph_of(board, interior_lens(), board_on_wall(), true_pose);
  const auto pose = marker_pose(photo, interior_lens(), board, board_on_wall());
  ASSERT_TRUE(pose) << pose.error().message();
  EXPECT_EQ(pose->ids_used.size(), 6u);
  RecordProperty("rotation_error_deg", std::to_string(rotation_error_deg(pose->world_from_camera, true_pose)));
  RecordProperty("position_error_m",
                 std::to_string(glm::length(glm::dvec3(pose->world_from_camera[3] - true_pose[3]))));
  EXPECT_LT(rotation_error_deg(pose->world_from_camera, true_pose), 0.15);
  EXPECT_LT(glm::length(glm::dvec3(pose->world_from_camera[3] - true_pose[3])), 0.003);
}

TEST(MarkerPose, the_curve_of_a_photograph_does_not_shrink_the_squares) {
  const BoardLayout board = BoardLayout::single("6X6_250", 23, 0.12);
  const glm::dmat4 true_pose = look_at({3.2, 2.4, 1.5}, {4, 2, 1.2}, {0, 0, 1});
  const Rgb8Image blurred =
      BoardCamera(interior_lens(), {1.0, {}, 0.0})
          .picture(*PrintedBoard::print(board, 0.024), glm::inverse(true_pose) * board_on_wall(), 1);
  const auto distance = [&](double exponent) {
    const auto pose = marker_pose(blurred, interior_lens(), board, board_on_wall(), "", exponent);
    return pose ? glm::length(glm::dvec3(pose->world_from_camera[3]) - glm::dvec3(4, 2, 1.2)) : 0.0;
  };
  const double truth = glm::length(glm::dvec3(true_pose[3]) - glm::dvec3(4, 2, 1.2));
  EXPECT_NEAR(distance(kPhotographExponent), truth, 0.001 * truth);
  EXPECT_GT(distance(kLinearExponent), 1.003 * truth) << "a smaller square looks further away";
}

TEST(MarkerPose, markers_that_are_not_recognised_are_found_by_the_board) {
  const BoardLayout board = *BoardLayout::grid("APRILTAG_36h11", {0, 1, 2, 3, 4, 5}, 3, 0.08, 0.04);
  const glm::dmat4 true_pose = look_at({3.5, 2.9, 1.3}, {4, 2, 1.2}, {0, 0, 1}); // 61 degrees
  const Rgb8Image photo = photograph_of(board, interior_lens(), board_on_wall(), true_pose);
  auto seen = *find_markers(photo, board.dictionary);
  ASSERT_GE(seen.size(), 2u);
  seen.resize(2); // of six
  const auto pose = refined_marker_pose(photo, seen, interior_lens(), board, board_on_wall());
  ASSERT_TRUE(pose) << pose.error().message();
  EXPECT_EQ(pose->ids_used.size(), 6u);
  EXPECT_LT(rotation_error_deg(pose->world_from_camera, true_pose), 0.2);
  EXPECT_LT(glm::length(glm::dvec3(pose->world_from_camera[3] - true_pose[3])), 0.002);
}

TEST(MarkerPose, a_marker_in_the_wrong_place_and_an_id_seen_twice_are_left_out) {
  const BoardLayout board = *BoardLayout::grid("6X6_250", {0, 1, 2, 3, 4, 5}, 3, 0.08, 0.04);
  const glm::dmat4 true_pose = look_at({3.1, 2.2, 1.4}, {4, 2, 1.2}, {0, 0, 1});
  auto seen = *find_markers(photograph_of(board, interior_lens(), board_on_wall(), true_pose), "6X6_250");
  ASSERT_EQ(seen.size(), 6u);
  for (glm::dvec2& corner : seen[4].corner_px)
    corner += glm::dvec2(25, -10);
  SeenMarker reflection = seen[2];
  for (glm::dvec2& corner : reflection.corner_px)
    corner.x += 200;
  seen.push_back(reflection);
  const auto pose = marker_pose(seen, interior_lens(), board, board_on_wall());
  ASSERT_TRUE(pose) << pose.error().message();
  EXPECT_EQ(pose->ids_used, (std::vector<int>{0, 1, 3, 5}));
  EXPECT_LT(rotation_error_deg(pose->world_from_camera, true_pose), 0.2);
}

TEST(MarkerPose, no_marker_says_what_was_looked_for_and_what_was_seen) {
  const BoardLayout drawn = BoardLayout::single("6X6_250", 40, 0.12);
  const auto photo =
      photograph_of(drawn, interior_lens(), board_on_wall(), look_at({3.2, 2.4, 1.5}, {4, 2, 1.2}, {0, 0, 1}));
  const auto pose =
      marker_pose(photo, interior_lens(), BoardLayout::single("6X6_250", 23, 0.12), board_on_wall(), "a.png");
  ASSERT_FALSE(pose);
  EXPECT_EQ(pose.error().code, ErrorCode::not_found);
  EXPECT_NE(pose.error().message().find("6X6_250 ids 23, seen 40"), std::string::npos) << pose.error().message();
  EXPECT_EQ(pose.error().where, "a.png");
  Rgb8Image grey{480, 360, std::vector<std::uint8_t>(480 * 360 * 3, 120)};
  EXPECT_NE(marker_pose(grey, interior_lens(), drawn, board_on_wall()).error().message().find("seen none"),
            std::string::npos);
}

TEST(MarkerPose, bad_requests_are_errors) {
  const Rgb8Image grey{480, 360, std::vector<std::uint8_t>(480 * 360 * 3, 120)};
  EXPECT_FALSE(marker_pose(grey, interior_lens(), BoardLayout::single("6X6_251", 1, 0.1), glm::dmat4(1.0)));
  EXPECT_FALSE(
      marker_pose(grey, ideal_pinhole(320, 240, 1.0), BoardLayout::single("6X6_250", 1, 0.1), glm::dmat4(1.0)));
  EXPECT_FALSE(marker_pose(Rgb8Image{}, interior_lens(), BoardLayout::single("6X6_250", 1, -0.1), glm::dmat4(1.0)));
  EXPECT_FALSE(marker_pose(grey, interior_lens(), BoardLayout{"6X6_250", {}}, glm::dmat4(1.0)));
  EXPECT_FALSE(BoardLayout::grid("6X6_250", {1, 2, 3}, 2, 0.1, 0.01));
}

TEST(MarkerPose, shared_photograph_shows_six_markers_on_one_table) {
  const std::filesystem::path data = std::filesystem::path(DAYLIT_SOURCE_DIR) / "../shared/data/markers";
  if (!std::filesystem::exists(data))
    GTEST_SKIP() << "the shared photograph is not here";
  const auto photo = read_ldr_image(data / "singlemarkersoriginal.jpg");
  ASSERT_TRUE(photo) << photo.error().message();
  const auto lens = read_lens(data / "tutorial_camera_params.yml");
  ASSERT_TRUE(lens) << lens.error().message();
  const auto seen = find_markers(*photo, "6X6_250");
  ASSERT_TRUE(seen);
  std::vector<int> ids;
  for (const SeenMarker& m : *seen)
    ids.push_back(m.id);
  EXPECT_EQ(ids, (std::vector<int>{23, 40, 62, 98, 124, 203}));
  // With a 5 cm side the markers lie 0.68 to 0.88 m away; on each board the camera is in front (z > 0).
  for (const int id : ids) {
    const auto pose = marker_pose(*seen, *lens, BoardLayout::single("6X6_250", id, 0.05), glm::dmat4(1.0));
    ASSERT_TRUE(pose) << pose.error().message();
    const glm::dvec3 eye(pose->world_from_camera[3]);
    EXPECT_GT(glm::length(eye), 0.66) << id;
    EXPECT_LT(glm::length(eye), 0.93) << id; // 0.88 without sub-pixel corners
    EXPECT_GT(eye.z, 0.2) << id;
    EXPECT_LT(pose->reprojection_rms_px, 0.5) << id;
  }
}

} // namespace
} // namespace daylit
