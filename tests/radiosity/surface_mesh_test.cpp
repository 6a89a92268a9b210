#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <gtest/gtest.h>

#include "radiosity/surface_mesh.h"
#include "tests/radiosity/rooms.h"

namespace daylit::radiosity {
namespace {

using testing::add_quad;
using testing::add_sphere;

/// South wall 4 x 2.5 m around a 1.6 x 1.2 m hole, from eight quads as modelling programs write it.
Room wall_with_hole() {
  Room room;
  room.materials.push_back({});
  const std::array<double, 4> x = {0, 1.2, 2.8, 4}, z = {0, 0.9, 2.1, 2.5};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (i != 1 || j != 1)
        add_quad(room, {x[i], 0, z[j]}, {x[i], 0, z[j + 1]}, {x[i + 1], 0, z[j + 1]}, {x[i + 1], 0, z[j]});
  return room;
}

double total_area(const SurfaceMesh& mesh) {
  double sum = 0;
  for (const Facet& p : mesh.facets)
    sum += p.area_m2;
  return sum;
}

double smallest_angle_deg(const Facet& p) {
  double smallest = 180;
  for (int k = 0; k < 3; ++k) {
    const glm::dvec3 u = glm::normalize(p.corner[(k + 1) % 3] - p.corner[k]);
    const glm::dvec3 v = glm::normalize(p.corner[(k + 2) % 3] - p.corner[k]);
    smallest = std::min(smallest, std::acos(glm::dot(u, v)) * 180 / 3.14159265358979);
  }
  return smallest;
}

TEST(SurfaceMesh, hole_stays_a_hole_and_area_is_exact) {
  const auto mesh = mesh_surfaces(wall_with_hole(), {.edge_m = 0.2});
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->planes, 1u);
  EXPECT_NEAR(total_area(*mesh), 4 * 2.5 - 1.6 * 1.2, 1e-9);
  for (const Facet& p : mesh->facets) {
    const glm::dvec3 c = (p.corner[0] + p.corner[1] + p.corner[2]) / 3.0 + mesh->origin;
    EXPECT_FALSE(c.x > 1.2 && c.x < 2.8 && c.z > 0.9 && c.z < 2.1);
    EXPECT_GT(smallest_angle_deg(p), 20.0);
    EXPECT_GT(glm::dot(p.normal, glm::cross(p.corner[1] - p.corner[0], p.corner[2] - p.corner[0])), 0.0);
  }
}

TEST(SurfaceMesh, seams_between_source_faces_at_any_offset_never_lose_a_wall) {
  // The refinement looks source faces up at triangle centroids, which can lie exactly on a seam.
  for (int shift = 0; shift < 20; ++shift) {
    Room room = wall_with_hole();
    for (glm::dvec3& v : room.vertices)
      v = glm::dvec3(v.x + 0.37 * shift, v.y, v.z * (1.0 + 0.01 * shift));
    const auto mesh = mesh_surfaces(room, {.edge_m = 0.4});
    ASSERT_TRUE(mesh);
    EXPECT_NEAR(total_area(*mesh), (4 * 2.5 - 1.6 * 1.2) * (1.0 + 0.01 * shift), 1e-9) << shift;
  }
}

TEST(SurfaceMesh, requested_count_is_met_within_five_percent) {
  for (const int target : {500, 2000, 8000}) {
    const auto mesh = mesh_surfaces(wall_with_hole(), {.target_facets = target});
    ASSERT_TRUE(mesh);
    EXPECT_NEAR(static_cast<double>(mesh->facets.size()) / target, 1.0, 0.05);
  }
}

/// A wall with 1,600 plates of 2 cm before it, no two in one plane.
Room wall_with_plates() {
  Room room = wall_with_hole();
  for (int i = 0; i < 1600; ++i) {
    const glm::dvec3 low(0.05 * (i % 40) + 0.02, -0.1 - 2e-4 * i, 0.06 * (i / 40) + 0.02), u(0.02, 0, 0), v(0, 0, 0.02);
    add_quad(room, low, low + v, low + v + u, low + u);
  }
  return room;
}

TEST(SurfaceMesh, count_that_is_met_is_of_facets_that_the_edge_length_decides) {
  for (const int target : {200, 400}) {
    const auto mesh = mesh_surfaces(wall_with_plates(), {.target_facets = target});
    ASSERT_TRUE(mesh);
    EXPECT_GE(mesh->fixed_facets, 3200u);
    EXPECT_NEAR(static_cast<double>(mesh->facets.size() - mesh->fixed_facets) / target, 1.0, 0.05);
  }
}

TEST(SurfaceMesh, where_the_count_jumps_at_an_edge_length_the_finer_mesh_is_taken) {
  Room room; // 160 equal strips: all are cut in two at one edge length, in four at the next
  room.materials.push_back({});
  for (int i = 0; i < 160; ++i)
    add_quad(room, {0, 0.1 * i, 0.01 * i}, {1, 0.1 * i, 0.01 * i}, {1, 0.1 * i + 0.05, 0.01 * i},
             {0, 0.1 * i + 0.05, 0.01 * i});
  for (const int target : {500, 1000, 1500}) {
    const auto mesh = mesh_surfaces(room, {.target_facets = target});
    ASSERT_TRUE(mesh);
    EXPECT_GE(mesh->facets.size() - mesh->fixed_facets, static_cast<std::size_t>(0.95 * target)) << target;
  }
}

TEST(SurfaceMesh, furniture_footprint_becomes_mesh_edges_on_the_floor) {
  Room room;
  room.materials.push_back({});
  add_quad(room, {0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0});
  const double c = std::cos(0.3), s = std::sin(0.3); // a turned box: its corners are not representable exactly
  const auto at = [&](double u, double v, double z) { return glm::dvec3(2 + c * u - s * v, 2 + s * u + c * v, z); };
  const std::array<glm::dvec2, 4> base = {glm::dvec2(-0.5, -0.5), {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
  for (int k = 0; k < 4; ++k) {
    const glm::dvec2 p = base[k], q = base[(k + 1) % 4];
    add_quad(room, at(p.x, p.y, 0), at(q.x, q.y, 0), at(q.x, q.y, 1), at(p.x, p.y, 1));
  }
  const auto mesh = mesh_surfaces(room, {.edge_m = 0.35});
  ASSERT_TRUE(mesh);
  double covered = 0;
  for (const Facet& p : mesh->facets) {
    const glm::dvec3 m = (p.corner[0] + p.corner[1] + p.corner[2]) / 3.0 + mesh->origin - glm::dvec3(2, 2, 0);
    if (std::abs(m.z) < 1e-9 && std::abs(c * m.x + s * m.y) < 0.5 && std::abs(-s * m.x + c * m.y) < 0.5)
      covered += p.area_m2;
  }
  EXPECT_NEAR(covered, 1.0, 1e-9); // exactly the footprint: no facet straddles it
  EXPECT_LT(mesh->facets.size(), 1500u);
}

TEST(SurfaceMesh, translation_by_a_thousand_kilometres_keeps_the_mesh) {
  Room far = wall_with_hole();
  for (glm::dvec3& v : far.vertices)
    v += glm::dvec3(1048576.0, -2097152.0, 524288.0); // exactly representable shift
  const auto here = mesh_surfaces(wall_with_hole(), {.edge_m = 0.2}), there = mesh_surfaces(far, {.edge_m = 0.2});
  ASSERT_TRUE(here && there);
  EXPECT_NEAR(total_area(*here), total_area(*there), 1e-7);
  EXPECT_EQ(here->doubled_m2, 0.0);
  EXPECT_EQ(there->doubled_m2, 0.0);
  EXPECT_NEAR(static_cast<double>(here->facets.size()), static_cast<double>(there->facets.size()),
              0.01 * static_cast<double>(here->facets.size()));
}

TEST(SurfaceMesh, overlapping_faces_of_one_wall_are_counted_once) {
  Room room;
  room.materials.push_back({});
  add_quad(room, {0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0});
  add_quad(room, {1, 0, 0}, {3, 0, 0}, {3, 1, 0}, {1, 1, 0});
  const auto mesh = mesh_surfaces(room, {.edge_m = 0.3});
  ASSERT_TRUE(mesh);
  EXPECT_NEAR(total_area(*mesh), 3.0, 1e-9);
  EXPECT_NEAR(mesh->doubled_m2, 1.0, 1e-9);
}

TEST(SurfaceMesh, a_face_doubled_the_other_way_round_is_counted_once) {
  Room room;
  room.materials.push_back({});
  add_quad(room, {0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0});
  add_quad(room, {0.5, 0, 0}, {0.5, 1, 0}, {1.5, 1, 0}, {1.5, 0, 0});
  const auto mesh = mesh_surfaces(room, {.edge_m = 0.3});
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->planes, 1u);
  EXPECT_NEAR(total_area(*mesh), 2.0, 1e-9);
  EXPECT_NEAR(mesh->doubled_m2, 1.0, 1e-9);
}

TEST(SurfaceMesh, of_two_materials_on_one_place_the_first_is_the_surface) {
  Room room;
  room.materials.resize(2);
  add_quad(room, {1, 0.25, 0}, {1.5, 0.25, 0}, {1.5, 0.75, 0}, {1, 0.75, 0}, 0); // a picture
  add_quad(room, {0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}, 1);                 // the wall behind it
  add_quad(room, {2, 0, 0}, {3, 0, 0}, {3, 1, 0}, {2, 1, 0}, 0);                 // beside the wall
  const auto mesh = mesh_surfaces(room, {.edge_m = 0.3});
  ASSERT_TRUE(mesh);
  std::array<double, 2> area{};
  for (const Facet& p : mesh->facets)
    area[p.material] += p.area_m2;
  EXPECT_NEAR(area[0], 1.25, 1e-9);
  EXPECT_NEAR(area[1], 1.75, 1e-9);
  EXPECT_NEAR(mesh->doubled_m2, 0.25, 1e-9);
}

double face_area(const Room& room) {
  double sum = 0;
  for (const RoomTriangle& t : room.triangles)
    sum += area_m2(room, t);
  return sum;
}

TEST(SurfaceMesh, sphere_of_twenty_thousand_facets_keeps_each_and_leaves_the_walls_their_share) {
  Room room = wall_with_hole();
  add_quad(room, {0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0});
  add_sphere(room, {2, 2, 1}, 0.6, 32);
  const auto mesh = mesh_surfaces(room, {});
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_GE(mesh->planes, 20480u);
  EXPECT_GT(mesh->facets.size(), 21000u);
  EXPECT_LT(mesh->facets.size(), 24500u);
  EXPECT_NEAR(total_area(*mesh), face_area(room), 1e-9);
}

TEST(SurfaceMesh, small_faces_of_curved_surfaces_are_not_cut_where_they_cross) {
  Room room = wall_with_hole();
  add_quad(room, {0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0});
  add_sphere(room, {2, 2, 1}, 0.6, 8);
  const auto one = mesh_surfaces(room, {.edge_m = 1});
  add_sphere(room, {2, 2.5, 1}, 0.6, 8);
  const auto two = mesh_surfaces(room, {.edge_m = 1});
  ASSERT_TRUE(one && two);
  EXPECT_EQ(two->facets.size() - one->facets.size(), 8 * 8 * 20u);
}

TEST(SurfaceMesh, faces_and_gaps_of_a_millimetre_cost_a_handful_of_facets) {
  Room room;
  room.materials.push_back({});
  add_quad(room, {0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0});
  const auto alone = mesh_surfaces(room, {.edge_m = 0.35});
  // A board 1 mm thick standing on the floor: two contact lines, and an upper face of 1 mm x 4 m.
  add_quad(room, {0, 2, 0}, {4, 2, 0}, {4, 2, 1}, {0, 2, 1});
  add_quad(room, {0, 2.001, 0}, {4, 2.001, 0}, {4, 2.001, 1}, {0, 2.001, 1});
  add_quad(room, {0, 2, 1}, {4, 2, 1}, {4, 2.001, 1}, {0, 2.001, 1});
  const auto with_board = mesh_surfaces(room, {.edge_m = 0.35});
  ASSERT_TRUE(alone && with_board);
  EXPECT_NEAR(total_area(*with_board), 16 + 8 + 0.004, 1e-9);
  const double boards = 2.0 * static_cast<double>(alone->facets.size()) * 4.0 / 16.0;
  EXPECT_LT(static_cast<double>(with_board->facets.size()), 1.5 * (static_cast<double>(alone->facets.size()) + boards));
}

TEST(SurfaceMesh, slivers_of_aspect_a_million_belong_to_the_plane_they_lie_in) {
  Room room;
  room.materials.push_back({});
  const double h = 4e-6;
  add_quad(room, {0, 0, 0}, {4, 0, 0}, {4, 2, 0}, {0, 2, 0});
  add_quad(room, {0, 2, 0}, {4, 2, 0}, {4, 2 + h, 0}, {0, 2 + h, 0});
  add_quad(room, {0, 2 + h, 0}, {4, 2 + h, 0}, {4, 4, 0}, {0, 4, 0});
  for (glm::dvec3& v : room.vertices) // slanted: no coordinate is exact
    v = {v.x * 0.8 - v.y * 0.6, (v.x * 0.6 + v.y * 0.8) * 0.28, (v.x * 0.6 + v.y * 0.8) * 0.96};
  const auto mesh = mesh_surfaces(room, {.edge_m = 0.35});
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->planes, 1u);
  EXPECT_NEAR(total_area(*mesh), 16, 1e-4);
  EXPECT_LT(mesh->facets.size(), 1200u);
}

TEST(SurfaceMesh, faces_that_cross_at_any_angle_are_cut_where_they_cross) {
  for (const double angle : {1.5, 0.3, 0.01, 1e-4, 1e-7}) {
    Room room;
    room.materials.push_back({});
    add_quad(room, {-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0});
    const double c = std::cos(angle), s = std::sin(angle);
    add_quad(room, {-1, -1.7 * c, -1.7 * s}, {1, -1.7 * c, -1.7 * s}, {1.1, 1.7 * c, 1.7 * s},
             {-0.9, 1.7 * c, 1.7 * s});
    add_quad(room, {-1.0 * c, -2, -s}, {c, -2, s}, {c, 2, s}, {-1.0 * c, 2, -s});
    const auto mesh = mesh_surfaces(room, {.edge_m = 0.3});
    ASSERT_TRUE(mesh) << angle;
    EXPECT_LT(mesh->facets.size(), 3000u) << angle;
    EXPECT_NEAR(total_area(*mesh), angle > 1e-6 ? face_area(room) : 16.0, 1e-3) << angle;
  }
}

TEST(SurfaceMesh, reversed_faces_keep_area_count_and_turn_the_normal) {
  Room turned = wall_with_hole();
  for (RoomTriangle& t : turned.triangles)
    std::swap(t.vertex[1], t.vertex[2]);
  const auto front = mesh_surfaces(wall_with_hole(), {.edge_m = 0.3}), back = mesh_surfaces(turned, {.edge_m = 0.3});
  ASSERT_TRUE(front && back);
  EXPECT_NEAR(total_area(*front), total_area(*back), 1e-9);
  EXPECT_NEAR(static_cast<double>(front->facets.size()) / static_cast<double>(back->facets.size()), 1.0, 0.05);
  EXPECT_LT(glm::distance(front->facets[0].normal, -back->facets[0].normal), 1e-12);
}

TEST(SurfaceMesh, refuses_a_mesh_beyond_the_limit) {
  const auto mesh = mesh_surfaces(wall_with_hole(), {.edge_m = 0.001});
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.error().code, ErrorCode::limit_exceeded);
}

/// Widest facet across (along y) of those at a height, metres.
double widest(const SurfaceMesh& mesh, double z) {
  double most = 0;
  for (const Facet& p : mesh.facets) {
    const auto [low, high] = std::minmax({p.corner[0].y, p.corner[1].y, p.corner[2].y});
    const bool level =
        std::ranges::all_of(p.corner, [&](const glm::dvec3& c) { return std::abs(c.z + mesh.origin.z - z) < 1e-9; });
    most = level ? std::max(most, high - low) : most;
  }
  return most;
}

Room level_rectangles(std::initializer_list<double> heights, double width, double depth) {
  Room room;
  room.materials.push_back({});
  for (const double z : heights)
    add_quad(room, {0, 0, z}, {width, 0, z}, {width, depth, z}, {0, depth, z});
  return room;
}

TEST(SurfaceMesh, slats_close_together_are_cut_lengthwise_into_four_strips_of_few_long_facets) {
  const auto slats = mesh_surfaces(level_rectangles({0.0, 0.1, 0.2}, 4, 0.12), {.edge_m = 1.0});
  ASSERT_TRUE(slats) << slats.error().message();
  for (const double z : {0.0, 0.1, 0.2})
    EXPECT_NEAR(widest(*slats, z), 0.03, 1e-6) << z;
  EXPECT_LE(slats->facets.size(), 3u * 64) << "not the 1,000 of each that facets as long as wide would be";
  EXPECT_NEAR(total_area(*slats), 3 * 4 * 0.12, 1e-9);
}

TEST(SurfaceMesh, what_is_no_slat_is_not_cut) {
  const auto apart = mesh_surfaces(level_rectangles({0.0, 0.2}, 4, 0.12), {.edge_m = 1.0});
  EXPECT_NEAR(widest(*apart, 0.0), 0.12, 1e-6) << "the next one is further than its width";
  const auto wide = mesh_surfaces(level_rectangles({0.0, 0.1}, 0.4, 0.12), {.edge_m = 1.0});
  EXPECT_NEAR(widest(*wide, 0.0), 0.12, 1e-6) << "not long";
  Room board = level_rectangles({0.0, 0.02}, 2, 0.2);
  for (const double y : {0.0, 0.2})
    add_quad(board, {0, y, 0}, {2, y, 0}, {2, y, 0.02}, {0, y, 0.02});
  const auto closed = mesh_surfaces(board, {.edge_m = 1.0});
  EXPECT_NEAR(widest(*closed, 0.0), 0.2, 1e-6) << "the inside of a board";
}

} // namespace
} // namespace daylit::radiosity
