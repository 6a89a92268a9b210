#include "runtime/indirect/sunlit_points.h"

#include <cmath>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "surrounded.h"

namespace daylit {
namespace {

using test::kPi;
using test::Surrounded;

DetectedSun sun_from(const glm::dvec3& direction, float normal_irradiance) {
  DetectedSun sun;
  sun.direction = glm::normalize(direction);
  sun.normal_irradiance = Rgb(normal_irradiance);
  return sun;
}

/// The low sun lights the white wall y = 0 from x = 1.2 to 2.8 up to 1.1 m; a ball stands before it.
struct LitWall {
  Surrounded room{0.05f, test::box_window()};
  DetectedSun sun = sun_from({0.0, 1.0, 0.2}, 100.0f);

  std::vector<SunlitPoint> points(const glm::dvec3& ball) const {
    glm::dmat4 world(1.0);
    world[3] = glm::dvec4(ball, 1.0);
    const PlacedParts parts({{&room.mesh_rays, room.mesh.triangles, room.mesh.positions, 0, world}});
    const RoomPlanes planes(room.volume.room);
    return sunlit_points(room.volume.room, room.rays, planes, test::box_window(), room.cells, sun, parts);
  }
  /// What they send to the floor at x.
  static double sent(const std::vector<SunlitPoint>& points, const glm::dvec3& x) {
    double sum = 0.0;
    for (const SunlitPoint& p : points) {
      const glm::dvec3 d = p.position - x;
      const double r2 = glm::dot(d, d), here = d.z, there = -glm::dot(p.normal, d);
      if (here > 0.0 && there > 0.0)
        sum += static_cast<double>(p.power.g) * here * there / (kPi * r2 * r2);
    }
    return sum;
  }
  /// The same by small squares of the wall.
  double sent_by_squares(const glm::dvec3& x) const {
    constexpr double kSide = 0.004;
    const double radiosity = 100.0 * glm::dot(sun.direction, glm::dvec3(0, 1, 0));
    double sum = 0.0;
    for (double u = 1.2 + 0.5 * kSide; u < 2.8; u += kSide)
      for (double v = 0.5 * kSide; v < 1.1; v += kSide) {
        const glm::dvec3 d = glm::dvec3(u, 0.0, v) - x;
        const double r2 = glm::dot(d, d);
        sum += radiosity * kSide * kSide * d.z * x.y / (kPi * r2 * r2);
      }
    return sum;
  }
};

TEST(SunlitPoints, light_the_floor_between_an_object_and_a_sunlit_wall_as_small_squares_do) {
  const LitWall lit;
  const std::vector<SunlitPoint> points = lit.points({2.0, 0.12, 0.05});
  for (const double y : {0.06, 0.12, 0.3, 1.0}) {
    const glm::dvec3 x(2.0, y, 0.0);
    EXPECT_NEAR(LitWall::sent(points, x), lit.sent_by_squares(x), 0.08 * lit.sent_by_squares(x)) << y;
  }
}

TEST(SunlitPoints, are_few_where_no_object_is_near_and_send_the_same_power) {
  const LitWall lit;
  const std::vector<SunlitPoint> near = lit.points({2.0, 0.12, 0.05}), far = lit.points({2.0, 4.0, 2.0});
  const auto power = [](const std::vector<SunlitPoint>& points) {
    double sum = 0.0;
    for (const SunlitPoint& p : points)
      sum += static_cast<double>(p.power.g);
    return sum;
  };
  EXPECT_LE(far.size(), 128u);
  EXPECT_GT(near.size(), far.size());
  EXPECT_LE(near.size(), 1000u);
  EXPECT_NEAR(power(near), power(far), 0.02 * power(far));
}

TEST(IndirectShadow, an_object_behind_a_sunlit_wall_hides_nothing_of_it) {
  Surrounded s(0.2f, test::box_window());
  s.place({2.0, -0.25, 0.5}, 0.0f, sun_from({0.0, 1.0, 0.2}, 100.0f));
  for (const double y : {0.2, 0.5, 1.0}) {
    const IndirectChange change = s.at({2.0, y, 0.0});
    EXPECT_NEAR(change.irradiance.g, 0.0f, 1e-3f * change.before.g) << y;
  }
}

TEST(IndirectShadow, takes_no_more_from_a_wall_beside_its_shadow_than_the_wall_has) {
  // The sun lights the floor up to the wall x = 0, and what the volume has of that is too little by half.
  Surrounded s(0.3f, test::box_window());
  s.place({0.45, 2.2, 0.3}, 0.0f, sun_from({0.6, 1.0, 0.5}, 40.0f));
  double most = 0.0;
  for (double y = 1.2; y < 2.3; y += 0.1)
    for (const double z : {0.02, 0.05, 0.1}) {
      const glm::dvec3 x(0.0, y, z);
      RayHit hit;
      ASSERT_TRUE(s.rays.closest(s.rays.to_local(x + glm::dvec3(0.5, 0, 0)), glm::vec3(-1, 0, 0), 0.0f, 1.0f, hit));
      const IndirectChange change = s.change.at(hit.triangle, x, {-1, 0, 0});
      const double part = static_cast<double>(-change.irradiance.g / change.before.g);
      most = std::max(most, part);
      EXPECT_LE(part, 1.0) << y << " " << z;
    }
  EXPECT_GT(most, 0.5);
}

} // namespace
} // namespace daylit
