#include "runtime/live/run_state.h"

#include <functional>

#include <gtest/gtest.h>

namespace daylit {
namespace {

/// Of a run that draws, changed as told.
std::string words(const std::function<void(CameraReport& sky, CameraReport& interior, RunState& state)>& change) {
  CameraReport sky, interior;
  sky.source.connected = interior.source.connected = true;
  const SkyBalance whole;
  RunState state{sky, interior, true, 3.2, &whole};
  change(sky, interior, state);
  return in_words(state);
}

TEST(RunState, the_first_thing_that_matters_is_said) {
  EXPECT_EQ(words([](auto&, auto&, auto&) {}), "drawing");
  EXPECT_EQ(words([](auto&, auto&, RunState& s) { s.wanted = false; }), "idle: nobody looks");
  EXPECT_EQ(words([](auto&, auto&, RunState& s) { s.tracking = TrackingState::lost; }),
            "marker lost: the photograph is left as it is");
  EXPECT_EQ(words([](auto&, CameraReport& interior, RunState& s) {
              s.tracking = TrackingState::lost;
              interior.blank = "white";
            }).substr(0, 23),
            "interior picture white:");
}

TEST(RunState, a_black_sky_is_said_with_the_age_of_the_last_good_one_but_not_of_a_bracket) {
  EXPECT_EQ(words([](CameraReport& sky, auto&, auto&) { sky.black = 1, sky.blank = "black", sky.frozen = true; }),
            "sky camera black: its last good picture is 3 s old");
  EXPECT_EQ(words([](CameraReport& sky, auto&, RunState& s) {
              sky.black = 1, sky.blank = "black";
              s.balance = nullptr;
            }),
            "no sky yet: the sky camera's picture is black");
  EXPECT_EQ(words([](CameraReport& sky, auto&, auto&) { sky.blank = "black"; }), "drawing");
}

TEST(RunState, light_that_the_sky_camera_does_not_hold_is_said) {
  const auto under = [](const SkyBalance& sky) { return words([&](auto&, auto&, RunState& s) { s.balance = &sky; }); };
  EXPECT_EQ(under({500, 500}), "drawing; 500 pixels of the sky are brighter than the camera holds");
  EXPECT_EQ(under({500, 480, true}), "drawing; 500 pixels of the sky are brighter than the camera holds");
  EXPECT_EQ(under({20, 0, true}), "drawing; the sun is brighter than the sky camera can show");
  EXPECT_EQ(under({20, 0, true, true}), "drawing");
  EXPECT_EQ(under({20, 0, true, false, Rgb(0.0f), "lux: cannot open the file"}),
            "drawing; the sun is brighter than the sky camera can show, no reading: lux: cannot open the file");
}

} // namespace
} // namespace daylit
