#include "runtime/indirect/window_visibility.h"

#include <cmath>

#include <gtest/gtest.h>

#include "surrounded.h"

namespace daylit {
namespace {

using test::Surrounded;

TEST(WindowVisibility, a_ball_before_a_near_window_hides_as_much_as_small_squares_say) {
  // On the sill of a window of 1.6 by 1.2 m, 12 cm before the pane, a ball of 3 cm half way.
  const std::vector<Aperture> pane = test::box_window();
  Surrounded s(0.03f, pane);
  const glm::dvec3 x(2.1, 4.88, 0.9), ball(2.1, 4.94, 0.95);
  glm::dmat4 world(1.0);
  world[3] = glm::dvec4(ball, 1.0);
  const PlacedParts parts({{&s.mesh_rays, s.mesh.triangles, s.mesh.positions, 0, world}});
  constexpr double kSide = 0.004;
  double hidden = 0.0, all = 0.0;
  for (double u = 1.2 + 0.5 * kSide; u < 2.8; u += kSide)
    for (double v = 0.9 + 0.5 * kSide; v < 2.1; v += kSide) {
      const glm::dvec3 d = glm::dvec3(u, 5.0, v) - x, w = glm::normalize(d), to = ball - x;
      const double weight = d.y * d.z / std::pow(glm::dot(d, d), 2.0);
      all += weight;
      hidden += glm::length(to - glm::dot(to, w) * w) < 0.03 ? weight : 0.0;
    }
  const WindowVisibility windows(s.rays, pane);
  const double blocked = static_cast<double>(windows.blocked_fraction(x, {0, 0, 1}, parts));
  EXPECT_GT(hidden / all, 0.1);
  EXPECT_NEAR(blocked, hidden / all, 0.2 * hidden / all);
}

TEST(WindowVisibility, what_is_known_at_a_point_serves_every_normal_there) {
  BasisVolume box = test::box_volume(test::box_window());
  const auto first = static_cast<std::uint32_t>(box.room.vertices.size());
  for (const glm::dvec3& corner : {glm::dvec3(1.2, 4.2, 0.0), {2.0, 4.2, 0.0}, {2.0, 4.2, 2.6}, {1.2, 4.2, 2.6}})
    box.room.vertices.push_back(corner); // a board before half of the window
  for (const std::uint32_t k : {1u, 2u})
    box.room.triangles.push_back({{first, first + k, first + k + 1}, box.room.triangles[0].material});
  const RayScene rays = *RayScene::build(box.room);
  const WindowVisibility windows(rays, box.apertures);
  const glm::dvec3 x(1.9, 3.3, 0.4);
  const WindowVisibility::SeenPoints seen = windows.seen_points(x);
  for (const glm::dvec3& n : {glm::dvec3(0, 0, 1), {0, 1, 0}, {1, 0, 0}, {-1, 0, 0}, {0, -0.6, 0.8}, {0, -1, 0}}) {
    EXPECT_EQ(windows.visible_fraction(x, n, seen), windows.visible_fraction(x, n)) << n.x << " " << n.y;
  }
  EXPECT_NEAR(windows.visible_fraction(x, {0, 1, 0}, seen), 0.5f, 0.2f);
}

} // namespace
} // namespace daylit
