// Points of the room beside an object, each with few directions: what a single one of them meets does not show.

#include <gtest/gtest.h>

#include "surrounded.h"

namespace daylit {
namespace {

using test::Surrounded;

/// Dark walls, and one bright piece of them as large as a window: few of a node's directions meet it behind the object.
TEST(IndirectShadow, near_an_object_a_bright_piece_of_wall_behind_it_makes_no_dots) {
  Surrounded s(0.15f);
  std::vector<Material>& materials = s.volume.room.materials;
  s.set_walls(0.05f);
  materials.push_back(materials[0]);
  materials.back().reflectance = Rgb(1.0f);
  for (RoomTriangle& t : s.volume.room.triangles)
    if (t.vertex[0] + 4 == s.volume.room.vertices.size()) // the piece in the window's place
      t.material = static_cast<std::uint32_t>(materials.size() - 1);
  s.place({2.0, 2.5, 0.16}, 0.0f);
  double square = 0.0, sum = 0.0;
  int count = 0;
  for (double x = 1.95; x < 2.05; x += 0.0021)
    for (double y = 2.42; y < 2.5; y += 0.0019, ++count) {
      const glm::dvec3 p(x, y, 0.0);
      const double kept = static_cast<double>(s.at(p).irradiance.g),
                   exact = static_cast<double>(s.change.evaluate(s.floor_at(p), p, {0, 0, -1}, 1024).irradiance.g);
      square += (kept - exact) * (kept - exact);
      sum += exact;
    }
  EXPECT_LT(std::sqrt(square / count), 0.07 * std::fabs(sum / count)) << "0.054; 0.092 between four corners alone";
}

} // namespace
} // namespace daylit
