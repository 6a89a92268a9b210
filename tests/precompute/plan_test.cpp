// From an error to settings: the plan is a pure function of a calibration, so its properties are tested on invented
// rooms; one real room shows that what is predicted comes true.

#include <cmath>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include "precompute/detail/point_ratios.h"
#include "precompute/planned_bake.h"
#include "scene/room/room_formats.h"
#include "tests/precompute/invented_room.h"
#include "tests/scene/test_rooms.h"

namespace daylit::precompute {
namespace {

int nodes_of(const Plan& plan) { return SkyPartition::parse(plan.regions)->size(); }

TEST(Plan, order_four_is_taken_where_nine_coefficients_leave_much) {
  CalibrationBake calibration = invented_room(0.02, 0.02, 0.1);
  PlanRequest request;
  const auto order = [&] { return make_plan(calibration, request)->options.sh_order; };
  const SkyError smooth{.sky = "overcast", .band4 = 0.003}, sun{.sky = "sun", .is_sun = true, .band4 = 0.008};
  calibration.fine.audit.sky = {smooth, sun};
  EXPECT_EQ(order(), ShOrder::second);
  calibration.fine.audit.sky[1].band4 = 0.03;
  EXPECT_EQ(order(), ShOrder::fourth);
  request.max_error = 0.08; // as much is nothing beside that
  EXPECT_EQ(order(), ShOrder::second);
  request.sh_order = ShOrder::fourth;
  EXPECT_EQ(order(), ShOrder::fourth);
  request = {};
  request.regions = "tregenza"; // would double its file
  request.must_reach = false;
  EXPECT_EQ(order(), ShOrder::second);
}

/// The invented room with facets of furniture, beside as many others.
CalibrationBake furnished_room(double mesh_error, double grid_error, double grid_sun, std::size_t of_furniture) {
  CalibrationBake calibration = invented_room(mesh_error, grid_error, grid_sun);
  calibration.fixed_facets = of_furniture;
  calibration.fine.facets += of_furniture;
  return calibration;
}

TEST(Plan, smaller_target_never_gives_less_of_anything) {
  for (const double mesh : {0.003, 0.03, 0.12})
    for (const auto& [grid, sun] : {std::pair{0.01, 0.0}, {0.01, 0.1}, {0.04, 0.0}, {0.04, 0.1}})
      for (const std::size_t of_furniture : {0, 3000, 10000}) {
        const CalibrationBake calibration = furnished_room(mesh, grid, sun, of_furniture);
        PlanRequest request;
        Result<Plan> before = make_plan(calibration, request);
        ASSERT_TRUE(before) << before.error().message();
        for (request.max_error = 0.08; request.max_error > 0.003; request.max_error /= 1.3) {
          const Result<Plan> plan = make_plan(calibration, request);
          ASSERT_TRUE(plan) << plan.error().message();
          if (request.max_error < 0.08) {
            EXPECT_LE(plan->options.facet_edge_m, before->options.facet_edge_m);
            EXPECT_LE(plan->options.spacing_m, before->options.spacing_m);
            EXPECT_GE(plan->options.visibility_rays, before->options.visibility_rays);
            EXPECT_GE(plan->options.gather_rays, before->options.gather_rays);
            EXPECT_LE(plan->options.compact_error, before->options.compact_error);
            EXPECT_GE(plan->options.clusters, before->options.clusters);
            EXPECT_GE(nodes_of(*plan), nodes_of(*before));
            EXPECT_GE(plan->options.sh_order, before->options.sh_order);
            EXPECT_GE(plan->predicted.seconds, before->predicted.seconds);
          }
          EXPECT_LE(plan->predicted.total, request.max_error);
          before = plan;
        }
      }
}

TEST(Plan, a_mesh_that_missed_its_part_is_followed_by_a_finer_one) {
  CalibrationBake calibration = invented_room(0.03, 0.02, 0.0);
  calibration.coarse.mean_facet_m2 = 2 * (calibration.fine.mean_facet_m2 = 0.5);
  const auto first = make_plan(calibration, {});
  ASSERT_TRUE(first) << first.error().message();
  BakeReport report;
  report.mean_facet_m2 = 0.6; // outlines and panes made few of the facets where light comes from
  const CalibrationBake better = corrected(calibration, *first, report);
  EXPECT_GT(better.mesh_error, calibration.mesh_error);
  EXPECT_LT(make_plan(better, {})->options.facet_edge_m, first->options.facet_edge_m);
}

TEST(Plan, calibration_meshes_that_are_the_same_are_followed_by_a_plan_too) {
  CalibrationBake calibration = invented_room(0.0, 0.02, 0.0);
  calibration.coarse.mean_facet_m2 = calibration.fine.mean_facet_m2 = 0.5;
  const auto first = make_plan(calibration, {});
  ASSERT_TRUE(first) << first.error().message();
  BakeReport report;
  report.mean_facet_m2 = 0.5;
  const auto next = make_plan(corrected(calibration, *first, report), {});
  ASSERT_TRUE(next) << next.error().message();
  EXPECT_EQ(next->options.facet_edge_m, first->options.facet_edge_m);
}

/// Of each room's surfaces the others see nothing: `rooms` of 4 x 4 x 3 m side by side, with a hole to the sky each.
double seen_in(int rooms) {
  test::RoomBuilder b;
  const auto wall = b.material("wall");
  for (int r = 0; r < rooms; ++r) {
    const double x = 4.2 * r;
    b.box({x, 0, 0}, {x + 4, 4, 3}, wall, 63 & ~4u);
    b.wall_with_hole(0.0, x, x + 4, 0, 3, x + 1, x + 3, 1, 2, wall);
  }
  const auto calibration =
      run_calibration_bake({b.room, {}, ""}, {}, {}, "", 0.0, [](const std::string&, double) { return true; });
  EXPECT_TRUE(calibration) << calibration.error().message();
  if (!calibration)
    return 0.0;
  EXPECT_NEAR(calibration->coarse.facet_edge_m / calibration->fine.facet_edge_m, std::numbers::sqrt2, 1e-9);
  EXPECT_NEAR(calibration->coarse.mean_facet_m2 / calibration->fine.mean_facet_m2, 2.0, 0.5);
  return calibration->seen_fraction;
}

TEST(Plan, one_place_sees_a_room_and_a_part_of_several_whose_factors_err_less) {
  const double one = seen_in(1), four = seen_in(4);
  EXPECT_GT(one, 0.8);
  EXPECT_NEAR(four / one, 0.25, 0.1);
  CalibrationBake calibration = invented_room(0.02, 0.02, 0.1);
  const auto error_at = [&](double seen, std::size_t rooms = 2) {
    calibration.seen_fraction = seen;
    calibration.rooms.resize(rooms);
    return make_plan(calibration, {})->options.compact_error;
  };
  const double of_one = error_at(one);
  EXPECT_EQ(error_at(0.7), of_one) << "furniture hides something of a room";
  EXPECT_LT(error_at(four), 0.6 * of_one);
  EXPECT_EQ(error_at(four, 1), of_one) << "probes in one room of four";
  EXPECT_NEAR(error_at(0.02), 0.4 * of_one, 0.01 * of_one) << "a large building";
}

TEST(Plan, beside_much_furniture_probes_are_closer_and_its_facets_share_clusters) {
  PlanRequest request;
  request.max_error = 0.04;
  const auto plan_with = [&](std::size_t of_furniture) {
    return make_plan(furnished_room(0.03, 0.04, 0.1, of_furniture), request)->options;
  };
  const BakeOptions bare = plan_with(0), some = plan_with(static_cast<std::size_t>(bare.target_facets)),
                    much = plan_with(10000);
  ASSERT_EQ(some.target_facets, bare.target_facets);
  ASSERT_EQ(much.target_facets, bare.target_facets);
  EXPECT_EQ(some.spacing_m, bare.spacing_m);
  EXPECT_EQ(some.compact_error, bare.compact_error);
  EXPECT_LT(much.spacing_m, 0.9 * bare.spacing_m);
  EXPECT_LT(much.compact_error, 0.7 * bare.compact_error);
  EXPECT_LT(much.clusters, 0.1 * 10000);
  EXPECT_GE(much.clusters, bare.clusters);
}

TEST(Plan, edges_are_no_longer_than_a_rooms_walls_are_high) {
  CalibrationBake calibration = invented_room(0.001, 0.04, 0.1);
  calibration.fine.facet_edge_m = 6.0;
  PlanRequest request;
  request.max_error = 0.04;
  const double free = make_plan(calibration, request)->options.facet_edge_m;
  EXPECT_GT(free, 6.0);
  for (const double height : {2.5, 3.5}) {
    Bounds box;
    box.include({0, 0, 0});
    box.include({9, 7, height});
    calibration.rooms.push_back({box});
  }
  const Result<Plan> plan = make_plan(calibration, request);
  EXPECT_DOUBLE_EQ(plan->options.facet_edge_m, 3.0);
  EXPECT_NEAR(plan->options.target_facets, 640 * 4, 1) << "as N ~ 1 / edge^2";
}

TEST(Plan, target_out_of_reach_is_refused_with_the_smallest_that_is_not) {
  const CalibrationBake calibration = invented_room(0.03, 0.04, 0.1);
  PlanRequest request;
  for (const double target : {0.0, -0.01, 1e-11, 1.5, std::nan("")}) {
    request.max_error = target;
    const Result<Plan> plan = make_plan(calibration, request);
    ASSERT_FALSE(plan) << target;
    EXPECT_EQ(plan.error().code, ErrorCode::value_invalid);
    EXPECT_EQ(plan.error().hint, target >= 1 ? "give a smaller one" : "give a larger one");
    const std::size_t at = plan.error().what.find("from ");
    ASSERT_NE(at, std::string::npos) << plan.error().what;
    request.max_error = 0.01 * std::stod(plan.error().what.substr(at + 5));
    EXPECT_TRUE(make_plan(calibration, request)) << "the smallest it named: " << request.max_error;
  }
}

TEST(Plan, what_the_user_fixed_is_kept_and_may_put_the_target_out_of_reach) {
  const CalibrationBake calibration = invented_room(0.03, 0.04, 0.1);
  PlanRequest request;
  request.max_error = 0.02;
  request.regions = "uniform:64";
  EXPECT_FALSE(make_plan(calibration, request)); // 64 constant regions alone are worse
  request.must_reach = false;
  const Result<Plan> plan = make_plan(calibration, request);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->regions, "uniform:64");
  EXPECT_GT(plan->predicted.total, 0.02);
  request.regions.clear();
  request.must_reach = true;
  request.facets = 5000;
  request.grid = glm::ivec3(20, 25, 14);
  const Result<Plan> fixed = make_plan(calibration, request);
  ASSERT_TRUE(fixed) << fixed.error().message();
  EXPECT_EQ(fixed->options.target_facets, 5000);
  EXPECT_EQ(fixed->options.grid, request.grid);
}

TEST(Plan, grid_is_graded_where_the_plan_chooses_it_or_where_that_is_asked_for) {
  CalibrationBake calibration = invented_room(0.03, 0.04, 0.1);
  calibration.density = {{{1, 2}, {}, {3, 1}}};
  const auto graded = [&](const PlanRequest& request) {
    return is_graded(make_plan(calibration, request)->options.density);
  };
  PlanRequest request;
  EXPECT_TRUE(graded(request));
  request.graded = false;
  EXPECT_FALSE(graded(request));
  PlanRequest counted, spaced;
  counted.grid = {20, 25, 14};
  spaced.spacing_m = 0.2;
  for (PlanRequest* given : {&counted, &spaced}) {
    EXPECT_FALSE(graded(*given)) << "the user's own grid";
    given->graded = true;
    EXPECT_TRUE(graded(*given));
  }
  request.graded = true;
  request.points = {{1, 1, 1}};
  EXPECT_FALSE(graded(request)) << "no grid";
}

TEST(Plan, given_points_need_no_grid) {
  PlanRequest request;
  request.points = {{1, 1, 1}, {2, 2, 1}};
  const Result<Plan> plan = make_plan(invented_room(0.03, 0.4, 0.1), request);
  ASSERT_TRUE(plan) << plan.error().message();
  EXPECT_EQ(plan->options.spacing_m, 0.0);
  EXPECT_EQ(plan->options.points.size(), 2u);
}

TEST(PlannedBake, second_bake_is_for_a_target_that_it_meets_with_a_file_at_most_twice_as_large) {
  Plan first;
  first.max_error = 0.02;
  first.predicted.bytes = 1e6;
  const auto against = [&](double error, double bytes) {
    Plan better;
    better.predicted = {.total = error, .bytes = bytes};
    return against_a_second_bake(first, better);
  };
  const std::string out_of_reach = "what this one missed is out of reach";
  EXPECT_EQ(against(0.019, 1.9e6), "");
  EXPECT_EQ(against(0.019, 2.1e6), "its file would be more than 2 times as large");
  EXPECT_EQ(against(0.021, 1.5e6), out_of_reach);
  EXPECT_EQ(against_a_second_bake(first, Error{ErrorCode::value_invalid, "no plan", "", ""}), out_of_reach);
}

TEST(PointRatios, one_point_counts_for_at_most_a_tenth_of_the_limited_error) {
  detail::PointRatios points;
  for (int i = 0; i < 36; ++i)
    points.add({.error2 = 1.0, .power2 = 100.0});
  EXPECT_NEAR(points.nrms(), 0.1, 1e-12);
  EXPECT_NEAR(points.limited_nrms(), 0.1, 1e-12);
  points.add({.error2 = 1000.0, .power2 = 100.0});
  EXPECT_NEAR(points.nrms(), std::sqrt(1036.0 / 3700.0), 1e-12);
  EXPECT_NEAR(points.limited_nrms(), std::sqrt(40.0 / 3700.0), 1e-12) << "36 + a tenth of 40";
  points.add({.error2 = 500.0, .power2 = 100.0});
  EXPECT_NEAR(points.limited_nrms(), std::sqrt(45.0 / 3800.0), 1e-12) << "36 + two tenths of 45";
}

TEST(PointRatios, of_few_points_every_one_counts) {
  detail::PointRatios points;
  for (const double error2 : {1.0, 1.0, 100.0})
    points.add({error2, 100.0});
  EXPECT_EQ(points.limited_nrms(), points.nrms());
}

TEST(PlannedBake, prediction_and_measurement_agree_within_a_factor_of_two_and_the_target_is_met) {
  const auto room = read_room(DAYLIT_SOURCE_DIR "/tests/fixtures/truth/s3_furnace.obj");
  ASSERT_TRUE(room) << room.error().message();
  PlanRequest request;
  request.max_error = 0.04;
  std::string said;
  const auto baked = bake_to_error(
      *room, request, nullptr, [](const std::string&, double) { return true; },
      [&](const std::string& t) { said += t; });
  ASSERT_TRUE(baked) << baked.error().message();
  EXPECT_NE(said.find("predicted"), std::string::npos);
  EXPECT_LE(baked->measured.total, 0.04);
  EXPECT_GE(baked->measured.points, 32u);
  EXPECT_LT(std::abs(std::log2(baked->measured.total / baked->plan.predicted.total)), 1.0);
}

} // namespace
} // namespace daylit::precompute
