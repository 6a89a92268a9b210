// Rows of form factors where facets are a thousand times longer than wide.

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "radiosity/form_factors.h"
#include "radiosity/surface_mesh.h"
#include "tests/radiosity/rooms.h"

namespace daylit::radiosity {
namespace {

using testing::add_box;
const Progress kSilent = [](const std::string&, double) { return true; };

/// A closed box whose floor is cut by hand into strips 4 m long and 4 mm wide, two triangles each.
struct Slivered {
  Room room = testing::grey_room(0.5f);
  SurfaceMesh mesh;
  PatchSet set;

  Slivered() {
    add_box(room, {0, 0, 0}, {4, 0.1, 2}, 0b111111u, true);
    const auto add = [&](const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, std::uint32_t plane) {
      const glm::dvec3 n = glm::cross(b - a, c - a);
      mesh.facets.push_back({{a, b, c}, glm::normalize(n), 0.5 * glm::length(n), plane, 0});
    };
    for (int k = 0; k < 25; ++k) {
      const double y = 0.004 * k, z = y + 0.004;
      add({0, y, 0}, {4, y, 0}, {4, z, 0}, 0);
      add({0, y, 0}, {4, z, 0}, {0, z, 0}, 0);
    }
    std::uint32_t plane = 0;
    for (std::size_t t = 2; t < room.triangles.size(); ++t) { // the other five faces as they are
      plane += t % 2 == 0;
      add(room.corner(room.triangles[t], 0), room.corner(room.triangles[t], 1), room.corner(room.triangles[t], 2),
          plane);
    }
    mesh.planes = plane + 1;
    for (std::uint32_t i = 0; i < mesh.facets.size(); ++i)
      set.patches.push_back({mesh.facets[i].corner, mesh.facets[i].normal, mesh.facets[i].area_m2, Rgb(0.5f), i});
  }
};

TEST(FormFactors, rows_of_slivers_a_thousand_times_longer_than_wide_close_within_a_thousandth) {
  const Slivered s;
  const auto m = exchange_areas(s.set, s.mesh, s.room, *RayScene::build(s.room), {}, kSilent);
  ASSERT_TRUE(m);
  const auto sums = m->row_sums();
  for (std::size_t i = 0; i < sums.size(); ++i)
    EXPECT_NEAR(sums[i] / s.set.patches[i].area_m2, 1.0, 1e-3) << i;
}

} // namespace
} // namespace daylit::radiosity
