// Rays that points aim at small holes, beside the fan's rays alone.

#include "radiosity/detail/aimed_rays.h"

#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "radiosity/gather.h"
#include "tests/radiosity/solved_room.h"
#include "tests/scene/test_rooms.h"

namespace daylit::radiosity {
namespace {

using test::RoomBuilder;
using testing::kSilent;
using testing::prepare;
using testing::Solved;

using Holes = std::vector<HoleOutline>;

const HoleOutline kSquare{{-0.1, 1, -0.1}, {0.1, 1, -0.1}, {0.1, 1, 0.1}, {-0.1, 1, 0.1}};
constexpr glm::dvec3 kPoint{0, 0, 0};
const auto kAll = [](const glm::vec3&) { return true; };

double sum_sr(const AimedRays& aimed) {
  double sum = 0;
  for (const AimedRay& ray : aimed.ray)
    sum += static_cast<double>(ray.solid_angle_sr);
  return sum;
}

TEST(AimedRays, fill_the_solid_angle_of_a_square) {
  const AimedRays aimed = AimedRays::of(kPoint, Holes{kSquare}, 1024, kAll);
  ASSERT_EQ(aimed.ray.size(), 64u);
  EXPECT_NEAR(sum_sr(aimed), 4 * std::asin(0.01 / 1.01), 1e-6); // a square of half angle tangents 0.1
  glm::dvec3 mean(0.0);
  for (const AimedRay& ray : aimed.ray) {
    const glm::dvec3 at = glm::dvec3(ray.direction) / static_cast<double>(ray.direction.y);
    EXPECT_LT(std::max(std::abs(at.x), std::abs(at.z)), 0.1001);
    EXPECT_TRUE(aimed.covers(ray.direction));
    mean += at / 64.0;
  }
  EXPECT_NEAR(mean.x, 0.0, 0.003);
  EXPECT_NEAR(mean.z, 0.0, 0.003);
  EXPECT_FALSE(aimed.covers({0.11, 1, 0}));
  EXPECT_FALSE(aimed.covers({0, -1, 0})) << "behind";
}

TEST(AimedRays, both_rims_of_a_hole_in_a_thick_wall_count_as_the_nearer) {
  HoleOutline beyond = kSquare;
  for (glm::dvec3& c : beyond)
    c.y = 1.2;
  EXPECT_NEAR(sum_sr(AimedRays::of(kPoint, Holes{beyond, kSquare}, 1024, kAll)), 4 * std::asin(0.01 / 1.01), 1e-6);
}

TEST(AimedRays, are_aimed_at_the_four_largest_of_the_holes_that_are_seen) {
  Holes holes;
  for (int k = 0; k < 7; ++k) { // ever further to the side, ever larger
    holes.push_back(kSquare);
    for (glm::dvec3& c : holes.back())
      c = (1.0 + 0.1 * k) * (c - glm::dvec3(0, 1, 0)) + glm::dvec3(0.4 * k - 1.2, 1, 0);
  }
  const auto sees = [](const glm::vec3& way) { return way.x < 0.5f; }; // not the last two
  const AimedRays aimed = AimedRays::of(kPoint, holes, 512, sees);
  ASSERT_EQ(aimed.hole.size(), 4u);
  EXPECT_EQ(aimed.ray.size(), 4u * 64u);
  for (const double x : {0.4, 0.0, -0.4})
    EXPECT_TRUE(aimed.covers({x, 1, 0})) << x;
  EXPECT_FALSE(aimed.covers({0.8, 1, 0}));
}

TEST(AimedRays, are_not_aimed_at_holes_that_the_fan_finds) {
  EXPECT_TRUE(AimedRays::of(kPoint, Holes{kSquare}, 64 * 1024, kAll).ray.empty());
  EXPECT_TRUE(AimedRays::of(kPoint, Holes{{{0, 0, 1}, {0, 1, 1}, {0, 1, 2}, {0, 0, 2}}}, 64, kAll).ray.empty())
      << "seen edge on";
}

/// A room of 3 x 3 x 2.5 m with a window, and one behind a hole of 10 cm in the wall between them.
Solved two_rooms() {
  RoomBuilder b;
  const auto wall = b.material("wall");
  b.box({0, 0, 0}, {3, 6, 2.5}, wall, 63 & ~4u);
  b.wall_with_hole(0, 0, 3, 0, 2.5, 0.5, 2.5, 1, 2, wall);
  b.wall_with_hole(3, 0, 3, 0, 2.5, 1, 1.1, 1, 1.1, wall);
  return prepare(b.room, 400);
}

/// Radiosity 1 in the room with the window, `dim` in the other.
std::vector<float> radiosity_of(const Solved& s, float dim) {
  std::vector<float> b;
  for (const Patch& e : s.set.patches) {
    const double y = (e.corner[0].y + e.corner[1].y + e.corner[2].y) / 3.0 + s.mesh.origin.y + 1e-3 * e.normal.y;
    b.push_back(y < 3.0 ? 1.0f : dim);
  }
  return b;
}

/// L_00 of each point, and L_20.
std::vector<double> light_at(const GatherHits& hits, std::span<const float> b) {
  std::vector<double> light;
  std::vector<float> rows(9 * hits.patches());
  for (std::size_t p = 0; p < hits.points(); ++p) {
    hits.weights(p, rows.data());
    for (const std::size_t lm : {0u, 6u}) {
      light.push_back(0.0);
      for (std::size_t e = 0; e < hits.patches(); ++e)
        light.back() += static_cast<double>(rows[lm * hits.patches() + e] * b[e]);
    }
  }
  return light;
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0, power = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    sum += (a[k] - b[k]) * (a[k] - b[k]);
    power += b[k] * b[k];
  }
  return std::sqrt(sum / power);
}

struct Behind {
  Solved s = two_rooms();
  std::vector<HoleOutline> hole{{{1, 3, 1}, {1.1, 3, 1}, {1.1, 3, 1.1}, {1, 3, 1.1}}};
  std::vector<glm::dvec3> points{{0.4, 3.6, 0.5}, {1.3, 4.2, 1.4}, {2.1, 5.1, 0.8}, {1.1, 5.7, 1.2}, {2.6, 3.3, 2.0}};

  Behind() {
    for (glm::dvec3& c : hole[0])
      c -= s.mesh.origin;
    for (glm::dvec3& p : points)
      p -= s.mesh.origin;
  }
  GatherHits gather(int rays, std::size_t kept = GatherHits::kMostKeptBytes) const {
    return *gather_hits(points, s.set, s.mesh, s.scene, {.rays = rays}, kSilent, kept);
  }
};

TEST(AimedRays, in_a_dark_room_behind_a_hole_are_worth_a_hundred_times_the_rays) {
  const Behind room;
  const std::vector<float> b = radiosity_of(room.s, 0.0f);
  const std::vector<double> exact = light_at(room.gather(1 << 20), b);
  for (const std::size_t kept : {GatherHits::kMostKeptBytes, std::size_t{0}}) { // or traced again
    GatherHits aimed = room.gather(1024, kept);
    const double alone = distance(light_at(aimed, b), exact);
    ASSERT_TRUE(aimed.aim_at(room.hole, b, kSilent));
    EXPECT_LT(distance(light_at(aimed, b), exact), 0.03);
    EXPECT_GT(alone, 0.3);
  }
}

TEST(AimedRays, take_the_place_of_the_rays_of_every_fan) {
  const Behind room;
  const std::vector<float> b = radiosity_of(room.s, 0.2f);
  const std::vector<double> exact = light_at(room.gather(1 << 20), b);
  GatherHits aimed = room.gather(1024);
  ASSERT_TRUE(aimed.aim_at(room.hole, b, kSilent));
  ASSERT_TRUE(aimed.add_rays(std::vector<std::uint16_t>{0, 3, 0, 1, 0}, kSilent));
  EXPECT_LT(distance(light_at(aimed, b), exact), 0.004);
  std::vector<std::uint64_t> rays(aimed.patches(), 0);
  aimed.count_rays(1, rays);
  double all = 0;
  for (const std::uint64_t of_patch : rays)
    all += static_cast<double>(of_patch);
  EXPECT_NEAR(all / GatherHits::kRay, 4 * 1024, 10); // as many as without the hole
  EXPECT_NEAR(aimed.moments(1, b)[0], 0.2 + 0.8 * aimed.moments(1, radiosity_of(room.s, 0.0f))[0], 1e-3);
}

TEST(AimedRays, are_not_kept_where_the_hole_leads_to_a_darker_room) {
  const Behind room;
  GatherHits hits = room.gather(1024);
  const std::vector<double> before = light_at(hits, radiosity_of(room.s, 3.0f));
  ASSERT_TRUE(hits.aim_at(room.hole, radiosity_of(room.s, 3.0f), kSilent));
  EXPECT_EQ(light_at(hits, radiosity_of(room.s, 3.0f)), before);
}

} // namespace
} // namespace daylit::radiosity
