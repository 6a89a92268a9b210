// Models of very many faces are simplified for the transport: what stays, and what must not move.

#include <cmath>
#include <map>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "precompute/transport_model.h"
#include "scene/room/aperture.h"
#include "tests/scene/test_rooms.h"

namespace daylit::precompute {
namespace {

using test::RoomBuilder;

/// Triangles of a sphere, n times 2 n times 2, that share no vertices, as artists' programs write them.
void sphere(RoomBuilder& b, const glm::dvec3& middle, double radius, int n, std::uint32_t material) {
  const auto at = [&](int i, int j) {
    const double theta = std::numbers::pi * j / n, phi = std::numbers::pi * (i % (2 * n)) / n;
    return middle +
           radius * glm::dvec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
  };
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < 2 * n; ++i)
      b.quad(at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j), material);
}

/// 4 x 5 x 3 m with a window and two spheres of n^2 x 4 triangles each.
RoomFile with_spheres(int n) {
  RoomBuilder b;
  const auto wall = b.material("wall"), red = b.material("red"), blue = b.material("blue"), pane = b.material("window");
  b.box({0, 0, 0}, {4, 5, 3}, wall, 63 & ~8u);
  b.wall_with_hole(5, 0, 4, 0, 3, 1, 3, 1, 2.2, wall);
  b.quad({1, 5, 1}, {3, 5, 1}, {3, 5, 2.2}, {1, 5, 2.2}, pane);
  sphere(b, {1.2, 2, 0.5}, 0.4, n, red);
  sphere(b, {2.6, 2, 1.0}, 0.6, n, blue);
  return {b.room, {}, "hash"};
}

std::map<std::string, double> areas(const Room& room) {
  std::map<std::string, double> out;
  for (const RoomTriangle& t : room.triangles)
    out[room.material(t).name] += area_m2(room, t);
  return out;
}

TEST(TransportModel, of_few_faces_is_the_model) {
  RoomFile file = with_spheres(30);
  const auto model = transport_model(file);
  ASSERT_TRUE(model);
  EXPECT_EQ(model->room.vertices, file.room.vertices);
  EXPECT_EQ(model->room.triangles.size(), file.room.triangles.size());
  EXPECT_TRUE(file.report.notes.empty());
  EXPECT_TRUE(simplified_surfaces(*model, file).triangles.empty());
}

TEST(TransportModel, of_many_faces_keeps_walls_windows_and_the_area_of_each_material) {
  RoomFile file = with_spheres(100);
  const std::size_t given = file.room.triangles.size();
  const auto model = transport_model(file);
  ASSERT_TRUE(model) << model.error().message();
  EXPECT_EQ(file.room.triangles.size(), given) << "the model itself stays";
  EXPECT_LE(model->room.triangles.size(), 5000u);
  EXPECT_EQ(model->room.bounds().min, file.room.bounds().min);
  EXPECT_EQ(model->room.bounds().max, file.room.bounds().max);
  const auto before = areas(file.room), after = areas(model->room);
  EXPECT_NEAR(after.at("wall"), before.at("wall"), 1e-6);
  EXPECT_NEAR(after.at("window"), before.at("window"), 1e-12);
  for (const char* name : {"red", "blue"})
    EXPECT_NEAR(after.at(name), before.at(name), 0.01 * before.at(name)) << name;
  for (const RoomTriangle& t : model->room.triangles) {
    if (model->room.material(t).name != "red")
      continue;
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(glm::length(model->room.corner(t, k) - glm::dvec3(1.2, 2, 0.5)), 0.4, 1e-9) << "a corner of it";
  }
  const auto rays = RayScene::build(model->room);
  ASSERT_TRUE(rays);
  const auto openings = find_apertures(model->room, *rays);
  ASSERT_TRUE(openings);
  EXPECT_EQ(openings->list.size(), 1u);
  EXPECT_NEAR(openings->report.unexplained_escape, 0.0, 1e-9) << "no joint opened";
  ASSERT_EQ(file.report.notes.size(), 1u);
  EXPECT_NE(file.report.notes[0].find(std::to_string(given) + " triangles"), std::string::npos);
}

TEST(TransportModel, surfaces_of_it_are_all_but_the_panes) {
  RoomFile file = with_spheres(100);
  const auto model = transport_model(file);
  ASSERT_TRUE(model) << model.error().message();
  const ReflectingSurfaces surfaces = simplified_surfaces(*model, file);
  EXPECT_EQ(surfaces.triangles.size(), model->room.triangles.size() - 2);
  EXPECT_LT(surfaces.vertices.size(), surfaces.triangles.size()) << "none that no triangle has";
  double area = 0, wanted = 0;
  for (const auto& t : surfaces.triangles)
    area += 0.5 * glm::length(glm::cross(surfaces.vertices[t[1]] - surfaces.vertices[t[0]],
                                         surfaces.vertices[t[2]] - surfaces.vertices[t[0]]));
  for (const auto& [name, of_one] : areas(model->room))
    wanted += name == "window" ? 0.0 : of_one;
  EXPECT_NEAR(area, wanted, 1e-9);
}

TEST(TransportModel, seams_that_gape_by_a_rounding_are_closed) {
  RoomFile file = with_spheres(100);
  const Room given = file.room;
  for (std::size_t v = 0; v < given.vertices.size(); ++v) // corners of one place, each moved another way
    if (given.vertices[v].z > 0.01 && given.vertices[v].z < 2.9)
      file.room.vertices[v] += 2e-5 * glm::dvec3(v % 3 == 0, v % 3 == 1, v % 3 == 2);
  const auto model = transport_model(file);
  ASSERT_TRUE(model) << model.error().message();
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges; // of the spheres: each belongs to two triangles
  for (const RoomTriangle& t : model->room.triangles)
    if (model->room.material(t).name == "red" || model->room.material(t).name == "blue")
      for (std::size_t k = 0; k < 3; ++k)
        ++edges[std::minmax(t.vertex[k], t.vertex[(k + 1) % 3])];
  ASSERT_GT(edges.size(), 1000u);
  for (const auto& [edge, count] : edges)
    EXPECT_EQ(count, 2);
}

TEST(TransportModel, of_leaves_that_cannot_be_fewer_is_refused) {
  RoomFile file = with_spheres(10);
  RoomBuilder b;
  b.room = file.room;
  for (int i = 0; i < 100; ++i)
    for (int j = 0; j < 60; ++j)
      b.quad({0.039 * i, 0.08 * j, 2}, {0.039 * i + 0.03, 0.08 * j, 2.1}, {0.039 * i + 0.03, 0.08 * j + 0.07, 2.2},
             {0.039 * i, 0.08 * j + 0.07, 2.1}, 1);
  file.room = b.room;
  const auto model = transport_model(file);
  ASSERT_FALSE(model);
  EXPECT_EQ(model.error().code, ErrorCode::limit_exceeded);
  EXPECT_NE(model.error().message().find("reduce the model"), std::string::npos) << model.error().message();
}

} // namespace
} // namespace daylit::precompute
