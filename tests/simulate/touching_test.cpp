// Glass that stands on the room: its lowest face lies in the floor.

#include <array>

#include <gtest/gtest.h>

#include "simulate/trace_scene.h"

namespace daylit {
namespace {

/// 0.2 m wide and high on the floor z = 0, faces apart so that each has its own normal.
ObjectMesh glass_cube() {
  ObjectMesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const float side : {-1.0f, 1.0f}) {
      glm::vec3 n(0.0f), u(0.0f), v(0.0f);
      n[axis] = side;
      u[(axis + 1) % 3] = side;
      v[(axis + 2) % 3] = 1.0f;
      const auto first = static_cast<std::uint32_t>(mesh.positions.size());
      for (const auto& [s, t] : {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)}) {
        mesh.positions.push_back(0.1f * (n + static_cast<float>(s) * u + static_cast<float>(t) * v) +
                                 glm::vec3(0.0f, 0.0f, 0.1f));
        mesh.normals.push_back(n);
      }
      mesh.triangles.push_back({first, first + 1, first + 2});
      mesh.triangles.push_back({first, first + 2, first + 3});
    }
  ObjectMaterial glass;
  glass.base_colour = Rgb(1.0f);
  glass.roughness = 0.0f;
  glass.transmission = 1.0f;
  mesh.materials = {glass};
  mesh.reflectance.assign(mesh.positions.size(), Rgb(1.0f));
  return mesh;
}

Room table() {
  Room room;
  room.vertices = {{-3.1, -2.7, 0}, {3.3, -2.7, 0}, {3.3, 2.9, 0}, {-3.1, 2.9, 0}};
  room.materials = {{"wood", Rgb(0.5f), Rgb(1.0f), false}};
  room.triangles = {{{0, 1, 2}, 0}, {{0, 2, 3}, 0}};
  return room;
}

TEST(Touching, a_ray_inside_glass_meets_its_lowest_face_before_the_table_and_the_table_behind_it) {
  const ObjectMesh cube = glass_cube();
  const SkyLight sky(SkyModel{});
  const auto scene = TraceScene::make(table(), {}, sky, &cube);
  ASSERT_TRUE(scene) << scene.error().message();
  for (int k = 0; k < 400; ++k) {
    const glm::vec3 from(-0.09f + 0.009f * static_cast<float>(k % 20), -0.09f + 0.009f * static_cast<float>(k / 20),
                         0.1f),
        d = glm::normalize(glm::vec3(0.02f * static_cast<float>(k % 7 - 3), 0.03f * static_cast<float>(k % 5 - 2), -1));
    if (const glm::vec3 end = from + 0.1f * d; std::max(std::abs(end.x), std::abs(end.y)) > 0.099f)
      continue;
    bool touched = false;
    const auto face = scene->closest(scene->to_local(from), d, true, touched);
    ASSERT_TRUE(face && face->on_object) << k;
    const glm::vec3 inside = face->position + scene->surface_offset() * face->geometric_normal,
                    below = face->position - scene->surface_offset() * face->geometric_normal;
    const auto wood = scene->closest(inside, below, d, true, touched);
    ASSERT_TRUE(wood) << k;
    EXPECT_FALSE(wood->on_object) << k;
  }
}

/// Through a side that leans by so much the point before the face lies lower than the point behind it.
TEST(Touching, a_ray_that_has_come_in_by_a_leaning_side_meets_the_lowest_face_before_the_table) {
  const ObjectMesh cube = glass_cube();
  const SkyLight sky(SkyModel{});
  const auto scene = TraceScene::make(table(), {}, sky, &cube);
  ASSERT_TRUE(scene) << scene.error().message();
  const glm::vec3 out = glm::normalize(glm::vec3(-1.0f, 0.0f, -0.4f)), d = glm::normalize(glm::vec3(1.0f, 0.1f, -0.3f));
  for (int k = 0; k < 20; ++k) {
    const glm::vec3 at = scene->to_local(glm::vec3(-0.09f, -0.05f + 0.005f * static_cast<float>(k), 0.03f)),
                    away = scene->surface_offset() * out;
    bool touched = false;
    const auto face = scene->closest(at + away, at - away, d, true, touched);
    ASSERT_TRUE(face) << k;
    EXPECT_TRUE(face->on_object) << k;
  }
}

} // namespace
} // namespace daylit
