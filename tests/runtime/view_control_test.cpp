// What mouse and keys do to the view, without a window.

#include <gtest/gtest.h>

#include "runtime/window/view_control.h"
#include "runtime/window/viewer.h"
#include "test_scene.h"

namespace daylit {
namespace {

RenderCamera camera_at(const glm::dvec3& eye, const glm::dvec3& target) {
  return *make_render_camera(ideal_pinhole(200, 150, 0.8), look_at(eye, target), 200, 150);
}

/// The pixel that shows a point.
glm::dvec2 pixel_of(const RenderCamera& c, const glm::dvec3& x) {
  const glm::dvec3 p = glm::transpose(glm::dmat3(c.world_from_camera)) * (x - c.eye());
  return {c.fx * p.x / p.z + c.cx, c.fy * p.y / p.z + c.cy};
}

TEST(Orbit, starts_at_the_pose_it_is_given_and_looks_at_its_target_always) {
  const glm::dmat4 pose = look_at({3.0, 4.0, 1.5}, {1.0, 1.0, 0.5});
  Orbit orbit = Orbit::about(pose, {1.0, 1.0, 0.5});
  for (int c = 0; c < 4; ++c)
    EXPECT_LT(glm::length(orbit.pose()[c] - pose[c]), 1e-9);
  const double distance = orbit.distance_m;
  for (int k = 0; k < 50; ++k) {
    orbit.turn({37.0, 29.0 * (k % 2 ? 1 : 1.5)}); // over the pole, if it could
    const glm::dmat4 p = orbit.pose();
    EXPECT_NEAR(glm::length(glm::dvec3(p[3]) - orbit.target), distance, 1e-9);
    EXPECT_LT(glm::length(glm::dvec3(p[3]) + distance * glm::dvec3(p[2]) - orbit.target), 1e-9);
    EXPECT_LT(p[1].z, 0.0) << "down stays down";
  }
  orbit.zoom(1.0);
  EXPECT_NEAR(orbit.distance_m, 0.9 * distance, 1e-12);
  orbit.zoom(1000.0);
  EXPECT_GT(orbit.distance_m, 0.0);
}

TEST(ViewControl, a_dragged_object_stays_under_the_mouse_and_on_its_floor) {
  const RenderCamera camera = camera_at({2.0, -1.0, 1.6}, {2.0, 2.0, 0.3});
  ViewControl control({{2.0, 2.0, 0.25}, {3.0, 2.0, 0.25}});
  const glm::dvec3 grip(2.05, 1.95, 0.25), aim(2.6, 2.4, 0.25); // points of its plane
  control.press(pixel_of(camera, grip), camera, 0, {2.0, 2.0, 0.4});
  ASSERT_EQ(control.held(), 0u);
  control.move(pixel_of(camera, aim), camera);
  EXPECT_LT(glm::length(control.position(0) - (glm::dvec3(2.0, 2.0, 0.25) + aim - grip)), 1e-6);
  EXPECT_EQ(control.position(1), glm::dvec3(3.0, 2.0, 0.25));
  control.move({100.0, -5000.0}, camera); // above the horizon: there is no floor
  EXPECT_LT(glm::length(control.position(0) - (glm::dvec3(2.0, 2.0, 0.25) + aim - grip)), 1e-6);
  control.release();
  control.move({10.0, 10.0}, camera);
  EXPECT_NEAR(control.position(0).x, 2.55, 1e-6);
  EXPECT_FALSE(control.orbit()) << "an object was dragged, not the camera";
}

TEST(ViewControl, beside_the_objects_the_camera_turns_until_r_brings_the_photograph_back) {
  const RenderCamera camera = camera_at({2.0, -1.0, 1.6}, {2.0, 2.0, 0.3});
  ViewControl control({{2.0, 2.0, 0.25}});
  control.press({5.0, 5.0}, camera, std::nullopt, {2.0, 2.0, 0.4});
  EXPECT_FALSE(control.held());
  control.move({45.0, 5.0}, camera);
  ASSERT_TRUE(control.orbit());
  EXPECT_EQ(control.position(0), glm::dvec3(2.0, 2.0, 0.25));
  control.key('r');
  EXPECT_FALSE(control.orbit());
}

TEST(ViewControl, an_object_stands_where_it_is_set_down_unless_the_mouse_holds_it) {
  const RenderCamera camera = camera_at({2.0, -1.0, 1.6}, {2.0, 2.0, 0.3});
  ViewControl control({{2.0, 2.0, 0.25}, {3.0, 2.0, 0.25}});
  control.press(pixel_of(camera, {2.0, 2.0, 0.25}), camera, 0, {2.0, 2.0, 0.4});
  control.place(0, {9.0, 9.0, 9.0});
  control.place(1, {3.0, 2.0, 0.75});
  EXPECT_EQ(control.position(0), glm::dvec3(2.0, 2.0, 0.25));
  EXPECT_EQ(control.position(1), glm::dvec3(3.0, 2.0, 0.75));
  control.release();
  control.place(0, {9.0, 9.0, 9.0});
  EXPECT_EQ(control.position(0), glm::dvec3(9.0, 9.0, 9.0));
}

TEST(ViewControl, s_asks_for_saving_once) {
  ViewControl control({});
  EXPECT_FALSE(control.take_save());
  control.key('s');
  EXPECT_TRUE(control.take_save());
  EXPECT_FALSE(control.take_save());
}

TEST(ViewControl, keys_switch_parts_of_the_light) {
  ViewControl control({});
  control.key('1'), control.key('3'), control.key('g');
  EXPECT_EQ(control.parts(), (ShownParts{false, true, false}));
  EXPECT_FALSE(control.shows_frame_times());
  control.key('1'), control.key('2'), control.key('3');
  EXPECT_EQ(control.parts(), (ShownParts{true, false, true}));
}

TEST(FrameGraph, bars_are_as_long_as_the_frames_took) {
  FrameGraph graph;
  for (int k = 0; k < 500; ++k)
    graph.add(k < 490 ? 10.0 : 50.0);
  Rgb8Image picture{160, 100, std::vector<std::uint8_t>(3 * 160 * 100, 0)};
  graph.draw(picture);
  const auto filled = [&](int x) {
    int count = 0;
    for (int y = 0; y < 100; ++y)
      count += picture.bytes[static_cast<std::size_t>(3 * (y * 160 + x))] > 0 ? 1 : 0;
    return count;
  };
  EXPECT_EQ(filled(0), 7);    // 6 and the line
  EXPECT_EQ(filled(119), 30); // the line lies inside
  EXPECT_EQ(filled(120), 0) << "the last 120 frames";
  Rgb8Image tiny{2, 2, std::vector<std::uint8_t>(12, 0)};
  graph.draw(tiny);
}

} // namespace
} // namespace daylit
