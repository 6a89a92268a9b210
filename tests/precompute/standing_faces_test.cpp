// Where probes and points of the audit stand for the light that objects on floors and tables receive.

#include <algorithm>
#include <cmath>

#include <glm/vector_relational.hpp>
#include <gtest/gtest.h>

#include "precompute/probe_density.h"
#include "precompute/probes.h"
#include "precompute/standing_faces.h"
#include "scene/volume/probe_planes.h"
#include "tests/scene/test_rooms.h"

namespace daylit::precompute {
namespace {

using test::RoomBuilder;

/// 4 x 5 x 3 m with a solid table top of 1.2 x 0.8 m at 0.75 m, a sheet at 1.3 m and a low box under a lamp.
Room furnished() {
  RoomBuilder b;
  const auto wall = b.material("wall"), wood = b.material("wood"), steel = b.material("steel");
  b.box({0, 0, 0}, {4, 5, 3}, wall);
  b.box({1, 2, 0.72}, {2.2, 2.8, 0.75}, wood);
  b.box({1.5, 2.3, 0.75}, {1.6, 2.4, 1.0}, steel, 31); // a thing on the table, without a top
  b.quad({3, 1, 1.3}, {3.6, 1, 1.3}, {3.6, 1.5, 1.3}, {3, 1.5, 1.3}, steel);
  return b.room;
}

bool near_one_of(const std::vector<double>& planes, double x, double within = 1e-9) {
  return std::ranges::any_of(planes, [&](double p) { return std::abs(p - x) < within; });
}

bool near_one_of(const std::vector<ProbePlane>& planes, double x) {
  return std::ranges::any_of(planes, [&](const ProbePlane& p) { return std::abs(p.at - x) < 1e-9; });
}

TEST(StandingFaces, are_level_have_air_above_and_are_large_enough) {
  const auto faces = standing_faces(furnished());
  ASSERT_TRUE(faces);
  ASSERT_EQ(faces->size(), 3u) << "floor, table and sheet: neither the ceiling nor the underside of the table";
  EXPECT_NEAR((*faces)[0].area_m2, 20.0, 1e-9);
  EXPECT_NEAR((*faces)[0].box.max.z, 0.0, 1e-9);
  for (const StandingFace& f : *faces)
    EXPECT_LT(f.box.max.z, 1.31);
}

TEST(StandingFaces, of_one_material_leave_out_the_others_and_an_unknown_one_is_refused) {
  const auto wood = standing_faces(furnished(), "wood");
  ASSERT_TRUE(wood);
  EXPECT_TRUE(std::ranges::none_of(*wood, [](const StandingFace& f) { return f.box.max.z < 0.5; }));
  EXPECT_FALSE(wood->empty());
  const auto none = standing_faces(furnished(), "marble");
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().what.find("marble"), std::string::npos);
}

TEST(StandingFaces, planes_lie_close_above_them_and_inside_their_edges) {
  const Room room = furnished();
  const Planes planes = planes_near(*standing_faces(room), room.bounds());
  for (const double z : {0.015, 0.08, 0.25, 0.765, 0.83, 1.0, 1.315, 1.38, 1.55})
    EXPECT_TRUE(near_one_of(planes[2], z)) << z;
  for (const double x : {0.1, 1.015, 1.1, 2.1, 2.185, 3.015, 3.1, 3.9})
    EXPECT_TRUE(near_one_of(planes[0], x)) << x;
  EXPECT_TRUE(std::ranges::is_sorted(planes[0], {}, &ProbePlane::at));
}

TEST(StandingFaces, a_plane_that_serves_two_of_them_is_there_once) {
  RoomBuilder b;
  const auto grey = b.material("grey");
  b.box({0, 0, 0}, {4, 5, 3}, grey);
  b.box({1, 1, 0.74}, {2, 2, 0.75}, grey, 32);
  b.box({1.005, 3, 0.74}, {2.005, 4, 0.752}, grey, 32); // 5 and 2 mm elsewhere
  const Planes planes = planes_near(*standing_faces(b.room), b.room.bounds());
  EXPECT_EQ(planes[2].size(), 6u);
  EXPECT_EQ(planes[0].size(), 6u);
  EXPECT_EQ(planes[1].size(), 10u);
}

TEST(StandingFaces, planes_lie_before_the_sides_of_furniture_and_below_its_top_and_are_wanted_there_alone) {
  RoomBuilder b;
  const auto grey = b.material("grey");
  b.box({0, 0, 0}, {4, 5, 3}, grey);
  b.box({0, 2, 0}, {1, 3, 0.8}, grey); // a chest at the wall
  const auto faces = standing_faces(b.room);
  Planes planes = planes_near(*faces, b.room.bounds());
  const std::size_t without = planes[0].size();
  add_planes_beside(*faces, b.room.bounds(), planes);
  const auto wanted = [&](int axis, double at, const glm::dvec3& p) {
    const auto& along = planes[static_cast<std::size_t>(axis)];
    const auto plane = std::ranges::find_if(along, [&](const ProbePlane& q) { return std::abs(q.at - at) < 1e-9; });
    const auto holds = [&](const Bounds& box) {
      return glm::all(glm::greaterThanEqual(p, box.min)) && glm::all(glm::lessThanEqual(p, box.max));
    };
    return plane != along.end() &&
           (std::ranges::any_of(plane->where, holds) || std::ranges::any_of(plane->beside, holds));
  };
  for (const double d : {0.015, 0.06}) {
    EXPECT_TRUE(wanted(0, 1 + d, {1 + d, 2.5, 0.5})) << d;
    EXPECT_TRUE(wanted(1, 2 - d, {0.5, 2 - d, 0.5})) << d;
    EXPECT_FALSE(wanted(0, 1 + d, {1 + d, 3.5, 0.5})) << d << ": not beside it";
    EXPECT_FALSE(wanted(0, 1 + d, {1 + d, 2.5, 1.0})) << d << ": not above it";
  }
  EXPECT_EQ(planes[0].size(), without + 2) << "none behind the wall";
  for (const double h : {0.015, 0.08}) {
    EXPECT_TRUE(wanted(2, 0.8 - h, {1.05, 2.5, 0.8 - h})) << h;
    EXPECT_FALSE(wanted(2, 0.8 - h, {2.0, 2.5, 0.8 - h})) << h;
  }
}

TEST(StandingFaces, planes_of_a_sill_are_wanted_up_to_the_ceiling_and_those_of_a_table_close_above_it) {
  RoomBuilder b;
  const auto grey = b.material("grey");
  b.box({0, 0, 0}, {4, 5, 3}, grey);
  b.box({1, 1, 0.74}, {2, 2, 0.75}, grey, 32);     // table
  b.box({1, 4.7, 0.9}, {2, 4.95, 0.95}, grey, 32); // sill
  const Planes planes = planes_near(*standing_faces(b.room), b.room.bounds());
  const auto top = [&](double y) {
    for (const ProbePlane& p : planes[1])
      if (std::abs(p.at - y) < 1e-3)
        return p.where.front().max.z;
    return -1.0;
  };
  EXPECT_NEAR(top(4.715), 3.0, 1e-9);
  EXPECT_NEAR(top(1.015), 1.25, 1e-9);
}

TEST(StandingFaces, no_two_planes_of_a_grid_stand_side_by_side_at_a_wall) {
  RoomBuilder b;
  const auto grey = b.material("grey");
  b.box({0, 0, 0}, {4, 5, 3}, grey);
  b.box({3.7, 1, 0.74}, {4, 2, 0.75}, grey, 32); // a shelf
  const Planes near = planes_near(*standing_faces(b.room), b.room.bounds());
  for (const double spacing : {0.12, 0.142, 0.149, 0.2, 0.5}) {
    const Planes planes = grid_planes(b.room.bounds(), glm::ivec3(0), spacing, {}, near);
    for (const auto& along : planes) {
      EXPECT_GT(along[1].at - along[0].at, 0.005) << spacing;
      EXPECT_GT(along.back().at - along[along.size() - 2].at, 0.005) << spacing;
    }
  }
}

TEST(StandingFaces, planes_lie_close_to_a_wall_above_a_sill_and_not_above_a_floor) {
  RoomBuilder b;
  const auto grey = b.material("grey");
  b.box({0, 0, 0}, {4, 5, 3}, grey);
  b.box({1, 4.7, 0.9}, {2, 5, 0.95}, grey, 32); // sill, up to the wall
  const Planes planes = planes_near(*standing_faces(b.room), b.room.bounds());
  EXPECT_TRUE(near_one_of(planes[1], 4.985));
  EXPECT_FALSE(near_one_of(planes[1], 0.015));
}

TEST(StandingFaces, points_are_1_to_30_cm_above_them_and_touch_nothing) {
  const Room room = furnished();
  const auto faces = standing_faces(room);
  const auto points = points_above(room, *faces, 400);
  ASSERT_TRUE(points);
  EXPECT_GT(points->size(), 330u);
  const auto rays = RayScene::build(room);
  int low = 0, on_table = 0;
  for (const glm::dvec3& p : *points) {
    const bool above = std::ranges::any_of(*faces, [&](const StandingFace& f) {
      const double h = p.z - f.box.max.z;
      return h > 0.0099 && h < 0.3001 && p.x > f.box.min.x && p.x < f.box.max.x && p.y > f.box.min.y &&
             p.y < f.box.max.y;
    });
    EXPECT_TRUE(above) << p.x << ' ' << p.y << ' ' << p.z;
    EXPECT_GE(rays->distance(rays->to_local(p), 1.0f), 0.0089f);
    low += p.z < 0.0548 && p.z > 0 ? 1 : 0; // half of the heights are below sqrt(1 cm 30 cm)
    on_table += p.z > 0.75 && p.z < 1.06 && p.x < 2.3 ? 1 : 0;
  }
  EXPECT_GT(low, 120);
  EXPECT_GT(on_table, 4);
}

TEST(StandingFaces, grid_has_the_planes_and_no_gap_much_longer_than_without_them) {
  const Bounds bounds = furnished().bounds();
  const Planes near = planes_near(*standing_faces(furnished()), bounds);
  const ProbeDensity density{{{1, 3, 2}, {}, {1, 1, 4}}};
  const ProbeSet grid = *make_grid(bounds, glm::ivec3(0), 0.3, density, near),
                 without = *make_grid(bounds, glm::ivec3(0), 0.3, density);
  ASSERT_TRUE(check_grid(grid));
  EXPECT_EQ(grid.count, grid_size(bounds, 0.3, density, near));
  for (std::size_t k = 0; k < 3; ++k) {
    const auto widest = [&](const ProbeSet& set) {
      double gap = 0;
      for (std::size_t i = 0; i + 1 < set.planes[k].size(); ++i)
        gap = std::max(gap, set.planes[k][i + 1] - set.planes[k][i]);
      return gap;
    };
    for (const ProbePlane& p : near[k])
      EXPECT_TRUE(near_one_of(grid.planes[k], p.at - bounds.centre()[static_cast<int>(k)], 1e-6)) << p.at;
    EXPECT_LT(widest(grid), 1.31 * widest(without));
  }
}

TEST(StandingFaces, planes_between_fixed_ones_are_those_of_the_density) {
  const std::vector<double> free = planes_of({1, 2}, 10, 0, 9), through = planes_of({1, 2}, 10, 0, 9, {free[4]});
  ASSERT_EQ(through.size(), free.size());
  for (std::size_t i = 0; i < free.size(); ++i)
    EXPECT_NEAR(through[i], free[i], 1e-9) << "a fixed plane where there is one anyway changes nothing";
}

} // namespace
} // namespace daylit::precompute
