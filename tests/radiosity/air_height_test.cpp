// Facets between boards, below benches: as short as the air there is high.

#include "radiosity/detail/air_height.h"

#include <algorithm>
#include <limits>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "radiosity/surface_mesh.h"
#include "tests/scene/test_rooms.h"

namespace daylit::radiosity {
namespace {

constexpr double kLow = 0.25, kLeast = 0.1;

/// A room of 4 x 4 x 3 m with a bench: a board of 2 x 1 m, 25 cm above the floor.
struct RoomWithBench {
  test::RoomBuilder b;
  std::uint32_t wall = b.material("wall"), wood = b.material("wood");
  RoomWithBench() {
    b.box({0, 0, 0}, {4, 4, 3}, wall);
    b.box({1, 1, kLow}, {3, 2, kLow + 0.05}, wood);
  }
};

const std::vector<glm::dvec3> kInRoom{{0.5, 0.5, 1}, {3.5, 3, 2}, {2, 3, 1}, {2, 1.5, 0.1}};

/// Of the facets of the floor whose middle lies below the bench, or does not.
double longest_on_floor(const SurfaceMesh& mesh, bool below) {
  double longest = 0;
  for (const Facet& f : mesh.facets) {
    const glm::dvec3 middle = (f.corner[0] + f.corner[1] + f.corner[2]) / 3.0 + mesh.origin;
    const bool is_below = middle.x > 1.3 && middle.x < 2.7 && middle.y > 1.3 && middle.y < 1.7;
    const bool far = middle.y > 2.8;
    for (std::size_t k = 0; middle.z < 1e-9 && (below ? is_below : far) && k < 3; ++k)
      longest = std::max(longest, glm::distance(f.corner[k], f.corner[(k + 1) % 3]));
  }
  return longest;
}

TEST(AirHeight, is_the_distance_between_the_surfaces_above_and_below_a_side_that_light_comes_to) {
  const RoomWithBench s;
  const SizeField field(s.b.room, *RayScene::build(s.b.room), kInRoom);
  const auto air = AirHeight::make(s.b.room, field, kLeast);
  ASSERT_TRUE(air);
  const glm::dvec3 up(0, 0, 1);
  EXPECT_NEAR(air->edge_m({2, 1.5, 0}, up, 1.0), kLow, 1e-5) << "the floor below the bench";
  EXPECT_NEAR(air->edge_m({2, 1.5, kLow}, up, 1.0), kLow, 1e-5) << "the bench from below; its inside is dark";
  EXPECT_EQ(air->edge_m({2, 1.5, kLow + 0.05}, up, 1.0), 1.0) << "the top of the bench";
  EXPECT_EQ(air->edge_m({2, 3, 0}, up, 1.0), 1.0);
  EXPECT_NEAR(air->edge_m({2, 3, 0}, up, 10.0), 3.0, 1e-5) << "edges longer than the room is high";
  EXPECT_EQ(air->edge_m({2, 1.5, 0}, up, 2.0), 0.5) << "no shorter than a quarter of the longest";
  EXPECT_NEAR(air->edge_m({0, 3, 1}, {1, 0, 0}, 10.0), 3.0, 1e-5) << "a wall";
}

TEST(AirHeight, lower_air_than_the_least_does_not_count) {
  const RoomWithBench s;
  const auto air = AirHeight::make(s.b.room, SizeField(), kLow + 0.01);
  ASSERT_TRUE(air);
  EXPECT_EQ(air->edge_m({2, 1.5, 0}, {0, 0, 1}, 1.0), 1.0);
}

TEST(AirHeight, facets_below_a_bench_are_no_longer_than_the_air_is_high_and_others_as_they_were) {
  const RoomWithBench s;
  const SizeField field(s.b.room, *RayScene::build(s.b.room), kInRoom);
  const auto with = mesh_surfaces(s.b.room, {.edge_m = 1.0, .low_air_m = kLeast, .field = field}),
             without = mesh_surfaces(s.b.room, {.edge_m = 1.0, .field = field});
  ASSERT_TRUE(with && without);
  EXPECT_LE(longest_on_floor(*with, true), kLow + 1e-6);
  EXPECT_GT(longest_on_floor(*without, true), 2 * kLow);
  EXPECT_EQ(longest_on_floor(*with, false), longest_on_floor(*without, false));
}

TEST(AirHeight, a_closed_space_between_two_floors_keeps_its_facets) {
  RoomWithBench s;
  s.b.box({0, 0, 3.2}, {4, 4, 6}, s.wall); // no light comes in between, and none above
  const SizeField field(s.b.room, *RayScene::build(s.b.room), kInRoom);
  const auto with = mesh_surfaces(s.b.room, {.edge_m = 1.0, .low_air_m = kLeast, .field = field}),
             without = mesh_surfaces(s.b.room, {.edge_m = 1.0, .field = field});
  ASSERT_TRUE(with && without);
  const auto above = [](const SurfaceMesh& mesh) {
    return std::ranges::count_if(mesh.facets, [&](const Facet& f) { return f.corner[0].z + mesh.origin.z > 2.99; });
  };
  EXPECT_EQ(above(*with), above(*without));
}

} // namespace
} // namespace daylit::radiosity
