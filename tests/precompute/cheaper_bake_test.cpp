// A bake in a given time, and what a long one could do instead.

#include <filesystem>
#include <fstream>
#include <iterator>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "precompute/cheaper_bake.h"
#include "precompute/parse_options.h"
#include "scene/room/room_formats.h"
#include "tests/packaging/shell.h"
#include "tests/precompute/invented_room.h"
#include "tests/scene/test_rooms.h"

namespace daylit::precompute {
namespace {

const Progress kSilent = [](const std::string&, double) { return true; };

TEST(ErrorInTime, is_the_smallest_that_is_predicted_to_fit_and_can_be_given_again) {
  const CalibrationBake calibration = invented_room(0.03, 0.04, 0.1);
  PlanRequest request;
  double before = 1;
  for (const double seconds : {2.0, 5.0, 20.0, 60.0}) {
    const Result<double> error = error_in_time(calibration, request, seconds);
    ASSERT_TRUE(error) << seconds << " s: " << error.error().message();
    request.max_error = *error;
    EXPECT_LE(make_plan(calibration, request)->predicted.seconds, seconds);
    request.max_error = *error / 1.2;
    const Result<Plan> finer = make_plan(calibration, request);
    EXPECT_TRUE(!finer || finer->predicted.seconds > seconds) << *error;
    EXPECT_EQ(*error, *parse_percent(fmt::format("{:.2g}", 100 * *error)));
    EXPECT_LT(*error, before);
    before = *error;
  }
}

TEST(ErrorInTime, too_little_time_is_refused_with_the_least_that_is_needed) {
  const CalibrationBake calibration = invented_room(0.03, 0.04, 0.1);
  const Result<double> none = error_in_time(calibration, {}, 0.1);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().where, "--time");
  const std::size_t at = none.error().what.find("about ");
  ASSERT_NE(at, std::string::npos) << none.error().what;
  EXPECT_TRUE(error_in_time(calibration, {}, 60 * 1.1 * std::stod(none.error().what.substr(at + 6))));
}

TEST(ContentArguments, are_those_that_decide_what_is_in_the_volume) {
  EXPECT_EQ(content_arguments({"x/daylit-precompute", "a.obj", "--time", "5", "-o", "b", "--threads=1", "--box", "1"},
                              " --max-error 3 --once"),
            "daylit-precompute a.obj --max-error 3 --once --box 1");
  EXPECT_EQ(content_arguments({"p", "--time=5", "a.obj", "--force", "--memory", "2"}, ""), "daylit-precompute a.obj");
}

/// Two rooms of 4 x 4 x 3 m, a metre apart, with a hole each.
RoomFile two_rooms() {
  test::RoomBuilder b;
  const auto wall = b.material("wall");
  for (const double x : {0.0, 5.0}) {
    b.box({x, 0, 0}, {x + 4, 4, 3}, wall, 63 & ~4u);
    b.wall_with_hole(0.0, x, x + 4, 0, 3, x + 1, x + 3, 1, 2, wall);
  }
  RoomFile file;
  file.room = std::move(b.room);
  return file;
}

TEST(CheaperBake, long_one_says_so_with_three_ways_that_take_less_and_a_short_one_says_nothing) {
  const RoomFile room = two_rooms();
  PlanRequest request;
  request.max_error = 0.04;
  auto planned = plan_bake(room, request, kSilent);
  ASSERT_TRUE(planned) << planned.error().message();
  const auto said = [&](double seconds) {
    planned->plan.predicted.seconds = seconds;
    const auto text = cheaper_text(room, *planned, kSilent);
    EXPECT_TRUE(text);
    return text ? *text : "";
  };
  EXPECT_EQ(said(30), "");
  EXPECT_EQ(said(599), "") << "and little memory";
  const std::string text = said(750);
  EXPECT_NE(text.find("12.5 minutes"), std::string::npos) << text;
  for (const char* option : {"--max-error 6", "--inside ", "--points FILE"})
    EXPECT_NE(text.find(option), std::string::npos) << option << "\n" << text;
  EXPECT_EQ(std::ranges::count(text, '\n'), 4);
  planned->request.box = {{0, 0, 0}, {4, 4, 3}};
  EXPECT_EQ(said(750).find("--inside"), std::string::npos) << "one room is what was asked for";
  EXPECT_NE(said(750).find("--regions uniform:256"), std::string::npos);
}

} // namespace
} // namespace daylit::precompute
