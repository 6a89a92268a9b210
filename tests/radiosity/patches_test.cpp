// Which facet sides belong to the problem: area against closed form, however fine the mesh.

#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <gtest/gtest.h>

#include "radiosity/patches.h"
#include "radiosity/surface_mesh.h"
#include "tests/radiosity/rooms.h"

namespace daylit::radiosity {
namespace {

using testing::add_quad;

/// Open-bottomed box of base `side` standing at (x, y), turned by `angle`: its corners have no exact coordinates.
void add_turned_box(Room& room, glm::dvec2 middle, double side, double height, double angle) {
  const double c = std::cos(angle), s = std::sin(angle), h = 0.5 * side;
  const auto at = [&](double u, double v, double z) {
    return glm::dvec3(middle.x + c * u - s * v, middle.y + s * u + c * v, z);
  };
  const std::array<glm::dvec2, 4> base = {glm::dvec2(-h, -h), {h, -h}, {h, h}, {-h, h}};
  for (int k = 0; k < 4; ++k) {
    const glm::dvec2 p = base[k], q = base[(k + 1) % 4];
    add_quad(room, at(p.x, p.y, 0), at(q.x, q.y, 0), at(q.x, q.y, height), at(p.x, p.y, height));
  }
  add_quad(room, at(-h, -h, height), at(h, -h, height), at(h, h, height), at(-h, h, height));
}

Room furnished_room() {
  Room room = testing::room_with_window_hole(0.5f);
  add_turned_box(room, {1.25, 3.5}, 0.9, 1.6, 0.297);
  add_turned_box(room, {2.75, 1.6}, 0.9, 0.8, -0.314);
  return room;
}
constexpr double kFurnishedArea_m2 = 2 * (4 * 5 + 4 * 2.8 + 5 * 2.8) - 1.6 * 1.2 + 4 * 0.9 * (1.6 + 0.8);

struct Found {
  std::size_t facets = 0, patches = 0, both = 0;
  double area_m2 = 0, facing_south_m2 = 0;
};

Found find(const Room& room, double edge_m) {
  const auto room_scene = RayScene::build(room);
  const auto apertures = find_apertures(room, *room_scene);
  EXPECT_TRUE(apertures);
  const auto mesh = mesh_surfaces(room, {.edge_m = edge_m});
  EXPECT_TRUE(mesh);
  const auto scene = facet_scene(*mesh);
  const PatchSet set = find_patches(room, *mesh, *scene, apertures->list);
  Found found{.facets = mesh->facets.size(), .patches = set.patches.size()};
  for (const auto& sides : set.of_facet)
    found.both += sides[0] >= 0 && sides[1] >= 0 ? 1 : 0;
  for (const Patch& e : set.patches) {
    found.area_m2 += e.area_m2;
    found.facing_south_m2 += e.normal.y < -0.5 ? e.area_m2 : 0.0;
  }
  return found;
}

TEST(Patches, insides_of_furniture_and_outsides_of_walls_stay_out_however_fine_the_mesh) {
  for (const double edge_m : {0.6, 0.4, 0.3, 0.25, 0.2}) {
    const Found found = find(furnished_room(), edge_m);
    EXPECT_NEAR(found.area_m2, kFurnishedArea_m2, 1e-9) << edge_m;
    EXPECT_LT(found.patches, found.facets) << edge_m;
  }
}

TEST(Patches, insides_of_cushions_that_lie_in_each_other_stay_out) {
  // Every face of one that crosses a face of the other has a part in the light and a part in the dark.
  for (const int n : {8, 12, 24}) {
    Room room = furnished_room();
    testing::add_sphere(room, {1.2, 1.5, 1.4}, 0.3, n);
    testing::add_sphere(room, {1.6, 1.6, 1.35}, 0.25, n);
    testing::add_sphere(room, {1.3, 1.3, 1.7}, 0.2, n);
    EXPECT_EQ(find(room, 0.4).both, 0u) << n;
  }
}

TEST(Patches, both_sides_of_a_thin_screen_in_the_air_are_kept) {
  Room room = furnished_room();
  add_quad(room, {2.0, 0.5, 2.0}, {3.0, 0.5, 2.0}, {3.0, 0.5, 2.5}, {2.0, 0.5, 2.5});
  EXPECT_NEAR(find(room, 0.3).area_m2, kFurnishedArea_m2 + 2 * 0.5, 1e-9);
}

TEST(Patches, walls_one_millimetre_apart_keep_their_gap_dark_where_it_is_closed) {
  // A second north wall a millimetre outside the first: nothing but a crack could lead there.
  Room room = furnished_room();
  testing::add_box(room, {0, 0, 0}, {4, 5.001, 2.8}, 0b001000u, true);
  EXPECT_NEAR(find(room, 0.25).area_m2, kFurnishedArea_m2, 1e-9);
}

TEST(Patches, both_faces_of_a_gap_one_millimetre_wide_are_found_to_its_end_where_it_is_open) {
  // A skin round the room, open to the south: what a patch sees is a patch, however few rays go along the gap.
  Room room = testing::room_with_window_hole(0.5f);
  testing::add_box(room, {-0.001, -0.001, -0.001}, {4.001, 5.001, 2.801}, 0b111011u, false);
  const double inside = 2 * (4 * 5 + 4 * 2.8 + 5 * 2.8) - 1.6 * 1.2, south = 4 * 2.8;
  const double skin = 2 * 5.002 * (4.002 + 2.802), skin_north = 4.002 * 2.802;
  for (const double edge_m : {1.5, 0.4}) {
    const Found found = find(room, edge_m);
    // The outside of the south wall sees hardly anything but sky, and only its border is kept.
    EXPECT_NEAR(found.area_m2 - found.facing_south_m2, 2 * (inside - south) + 1.6 * 1.2 + skin, 1e-6) << edge_m;
    EXPECT_GT(found.facing_south_m2, south + skin_north) << edge_m;
  }
}

/// Two rooms and a doorway between them. Their walls are sheets 12 cm apart whose floors and ceilings end at them: the
/// inside of the wall is open above and below, and a facet's edge lies on every sheet.
Room rooms_with_a_hollow_wall(double turn) {
  Room room = testing::grey_room(0.5f);
  testing::add_box(room, {0, 0, 0}, {4, 5, 2.8}, 0b110011u, true);
  testing::add_box(room, {0, 5.12, 0}, {4, 9, 2.8}, 0b111011u, true);
  testing::add_box(room, {1, 5, 0}, {2, 5.12, 2.05}, 0b110011u, true);
  const auto wall = [&](double y, const std::array<double, 4>& x, const std::array<double, 4>& z) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        if ((i != 1 || j != 1) && z[j + 1] > z[j])
          add_quad(room, {x[i], y, z[j]}, {x[i], y, z[j + 1]}, {x[i + 1], y, z[j + 1]}, {x[i + 1], y, z[j]});
  };
  wall(0, {0, 1.2, 2.8, 4}, {0, 0.9, 2.1, 2.8});
  wall(5, {0, 1, 2, 4}, {0, 0, 2.05, 2.8});
  wall(5.12, {0, 1, 2, 4}, {0, 0, 2.05, 2.8});
  for (glm::dvec3& v : room.vertices)
    v = glm::round(1e5 * glm::dvec3(std::cos(turn) * v.x - std::sin(turn) * v.y,
                                    std::sin(turn) * v.x + std::cos(turn) * v.y, v.z)) /
        1e5;
  return room;
}

TEST(Patches, insides_of_hollow_walls_stay_dark_though_rays_end_on_the_edges_of_floors) {
  const double first = 2 * (4 * 5 + 4 * 2.8 + 5 * 2.8) - 1.6 * 1.2 - 2.05;
  const double second = 2 * (4 * 3.88 + 4 * 2.8 + 3.88 * 2.8) - 2.05, doorway = 0.12 * (2 * 2.05 + 2);
  for (int k = 0; k < 60; ++k) {
    const double turn = 0.45 + 0.01 * k, edge_m = 0.3 + 0.01 * k;
    EXPECT_NEAR(find(rooms_with_a_hollow_wall(turn), edge_m).area_m2, first + second + doorway, 1e-3) << edge_m;
  }
}

TEST(Patches, every_facet_of_a_sphere_is_found_though_each_is_its_own_plane) {
  Room room = furnished_room();
  const std::size_t before = room.triangles.size();
  testing::add_sphere(room, {1.2, 1.5, 1.4}, 0.2, 12);
  double sphere = 0;
  for (std::size_t i = before; i < room.triangles.size(); ++i)
    sphere += area_m2(room, room.triangles[i]);
  EXPECT_NEAR(find(room, 0.4).area_m2, kFurnishedArea_m2 + sphere, 1e-9);
}

TEST(Patches, size_and_place_of_the_room_change_nothing) {
  for (const double scale : {1e-3, 1.0, 1e4}) {
    Room room = furnished_room();
    for (glm::dvec3& v : room.vertices)
      v = scale * (v + glm::dvec3(1e6, -2e6, 3e5));
    EXPECT_NEAR(find(room, 0.3 * scale).area_m2 / (scale * scale), kFurnishedArea_m2, 1e-6) << scale;
  }
}

} // namespace
} // namespace daylit::radiosity
