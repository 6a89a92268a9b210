// Furniture a little off walls and floor lights a room as furniture that touches them.

#include <cmath>

#include <gtest/gtest.h>

#include "precompute/room_frame.h"
#include "scene/sky/sky.h"
#include "scene/volume/indirect_light.h"
#include "tests/scene/test_rooms.h"

namespace daylit::precompute {
namespace {

/// A cupboard, a bench and a carpet in a room with a window: `gap` metres off the walls and the floor.
Room furnished(double gap) {
  test::RoomBuilder b;
  const auto white = b.material("white", Rgb(0.8f)), wood = b.material("wood", Rgb(0.4f));
  b.box({0, 0, 0}, {4, 3, 2.7}, white, 63 & ~4u);
  b.wall_with_hole(0.0, 0, 4, 0, 2.7, 1.2, 2.8, 0.9, 2.2, white);
  b.box({gap, 1.3, 0}, {gap + 0.3, 2.6, 2.0}, wood);
  b.box({3.2 - gap, 0.8, 0.35}, {4 - gap, 2.4, 0.8}, wood);
  b.box({1.0, 0.8, gap}, {2.8, 2.2, gap + 0.012}, wood);
  return b.room;
}

/// Mean irradiance on six axes at some points under a uniform sky.
double light(double gap, double near_m) {
  const RoomFile room{furnished(gap), {}, "furnished"};
  BakeOptions options;
  options.target_facets = 400;
  options.gather_rays = 4096;
  options.near_m = near_m;
  for (const double x : {0.8, 2.0, 3.0})
    for (const double y : {0.5, 2.7})
      for (const double z : {1.0, 2.3})
        options.points.emplace_back(x, y, z);
  BakeReport report;
  const auto volume = bake_room(
      room, *SkyPartition::uniform(64), options, [](const std::string&, double) { return true; }, report);
  EXPECT_TRUE(volume) << volume.error().message();
  const auto scene = RayScene::build(room.room);
  const auto indirect = IndirectLight::make(*volume, *scene, Sky(SkyModel{}));
  double sum = 0;
  for (const glm::dvec3& p : options.points)
    for (int axis = 0; axis < 6; ++axis) {
      glm::vec3 normal(0.0f);
      normal[axis / 2] = axis % 2 == 0 ? 1.0f : -1.0f;
      sum += static_cast<double>(irradiance(*indirect->at(p), normal).g);
    }
  return sum;
}

TEST(NearFurniture, gives_the_light_of_furniture_that_touches) {
  const double near_m = BakeOptions{}.near_m;
  EXPECT_NEAR(light(0.005, near_m) / light(0.0, near_m), 1.0, 0.008);
  EXPECT_LT(light(0.005, 0.0) / light(0.0, 0.0), 0.985); // what facets half behind it lose
}

} // namespace
} // namespace daylit::precompute
