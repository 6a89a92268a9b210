// Whole bakes: of a table before a window, and in a given time.

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "precompute/planned_bake.h"
#include "tests/packaging/shell.h"
#include "tests/scene/test_rooms.h"

namespace daylit::precompute {
namespace {

/// A white table before a window.
RoomFile room_with_table() {
  test::RoomBuilder b;
  const auto wall = b.material("wall", Rgb(0.6f)), dark = b.material("floor", Rgb(0.2f)),
             white = b.material("white", Rgb(0.8f));
  b.box({0, 0, 0}, {3, 3, 2.4}, wall, 63 & ~(8u | 16u));
  b.quad({0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {0, 3, 0}, dark);
  b.wall_with_hole(3, 0, 3, 0, 2.4, 0.8, 2.2, 0.9, 2.0, wall);
  b.box({0.9, 1.4, 0.71}, {2.1, 2.2, 0.74}, white);
  RoomFile file;
  file.room = std::move(b.room);
  return file;
}

/// A few points of 128 decide the figure: the mean over four bakes.
TEST(BakeToError, light_where_objects_stand_is_measured_and_near_planes_make_it_better) {
  const auto go_on = [](const std::string&, double) { return true; };
  double with = 0, without = 0;
  for (const double max_error : {0.05, 0.04, 0.03, 0.025})
    for (const bool graded : {true, false}) {
      PlanRequest request;
      request.max_error = max_error;
      if (!graded)
        request.graded = false;
      const auto baked = bake_to_error(room_with_table(), request, nullptr, go_on, [](const std::string&) {});
      ASSERT_TRUE(baked) << baked.error().message();
      EXPECT_EQ(baked->measured.standing_points, 128u);
      (graded ? with : without) += baked->measured.standing / 4;
    }
  EXPECT_GT(with, 0.003);
  EXPECT_LT(with, 0.05);
  EXPECT_LT(with, 0.95 * without) << without; // most is taken from the surfaces themselves, which needs no planes
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(BakeInTime, says_which_options_give_the_same_bits) {
  const std::filesystem::path folder = ::testing::TempDir() + "time" + std::to_string(::getpid());
  std::filesystem::create_directory(folder);
  const std::string programs = DAYLIT_BINARY_DIR "/bin/", in = "cd " + folder.string() + "; " + programs;
  const ShellOutcome timed = shell(in + "daylit-precompute " DAYLIT_SOURCE_DIR
                                        "/tests/fixtures/truth/s3_furnace.obj --time 0.15 -o a.volume --threads 2");
  ASSERT_EQ(timed.exit_code, 0) << timed.text;
  const std::string mark = "the same bits again, on any machine: ";
  const std::size_t at = timed.text.find(mark);
  ASSERT_NE(at, std::string::npos) << timed.text;
  const std::string again = timed.text.substr(at + mark.size(), timed.text.find('\n', at) - at - mark.size());
  const ShellOutcome same = shell(in + again + " -o b.volume --threads 1");
  EXPECT_EQ(same.exit_code, 0) << again << "\n" << same.text;
  EXPECT_FALSE(bytes_of(folder / "a.volume").empty());
  EXPECT_EQ(bytes_of(folder / "a.volume"), bytes_of(folder / "b.volume"));
  std::filesystem::remove_all(folder);
}

} // namespace
} // namespace daylit::precompute
