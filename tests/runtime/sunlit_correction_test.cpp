#include "runtime/indirect/sunlit_correction.h"

#include <cmath>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "sh/sh9.h"
#include "surrounded.h"

namespace daylit {
namespace {

using test::kPi;

const glm::dvec3 kVertex(2.0, 2.5, 1.0);

/// A vertex of an object in the air of the box room, and one sunlit point of it.
struct Lit {
  test::Surrounded room{0.1f};
  WindowVisibility windows{room.rays, {}};
  PlacedParts parts;
  SelfVisibility open, shut;

  Lit() {
    glm::dmat4 world(1.0);
    world[3] = glm::dvec4(kVertex, 1.0);
    parts = PlacedParts({{&room.mesh_rays, room.mesh.triangles, room.mesh.positions, 0, world}});
    const VertexRays rays(room.mesh, room.mesh_rays, 128);
    shut = SelfVisibility(rays, 1);
    SideView nothing;
    nothing.hidden.assign(128 / VertexRays::kFan, 0xFFFF);
    shut.set(0, false, nothing);
  }
  float at(const SunlitPoint& point, const glm::vec3& n, const TransferVector& transfer, bool sees = true) const {
    return SunlitCorrection({&point, 1}, parts, windows)
        .at(0, kVertex, {sees ? &open : &shut, 0, false, VertexRays::frame(n)}, transfer)
        .g;
  }
};

TransferVector unshadowed(const glm::vec3& n) {
  TransferVector t = sh::evaluate9(n);
  for (std::size_t i = 0; i < t.size(); ++i)
    t[i] *= static_cast<float>(sh::kClampedCosine9<double>[i]);
  return t;
}

// E = power / pi cos cos' / r^2 of a small diffuse source; nine coefficients give sum_lm L_lm C_lm of it.
TEST(SunlitCorrection, and_nine_coefficients_are_the_light_of_a_small_source) {
  const Lit s;
  const glm::dvec3 d(0.6, 0.0, -0.8); // to the source, 1 m away
  const SunlitPoint point{kVertex + d, {0, 0, 1}, Rgb(5.0f), 0.1};
  const double perpendicular = 5.0 / kPi * 0.8;
  for (const glm::vec3& n : {glm::vec3(0.6, 0, -0.8), glm::vec3(0, 0, -1), glm::vec3(0, 1, 0), glm::vec3(-0.6, 0, 0.8),
                             glm::vec3(0, 0, 1)}) {
    const std::array<float, 9> y = sh::evaluate9(glm::vec3(d));
    double coefficients = 0.0;
    for (std::size_t i = 0; i < y.size(); ++i)
      coefficients += perpendicular * static_cast<double>(y[i] * unshadowed(n)[i]);
    const double expected = perpendicular * std::max(0.0, glm::dot(glm::dvec3(n), d));
    EXPECT_NEAR(coefficients + static_cast<double>(s.at(point, n, unshadowed(n))), expected, 1e-4);
  }
  EXPECT_LT(s.at(point, {0, 1, 0}, unshadowed({0, 1, 0})), -0.01f) << "coefficients put light where the cosine is 0";
}

TEST(SunlitCorrection, of_what_the_object_hides_takes_away_what_coefficients_gave) {
  const Lit s;
  const SunlitPoint point{kVertex - glm::dvec3(0, 0, 0.9), {0, 0, 1}, Rgb(5.0f), 0.1};
  EXPECT_NEAR(s.at(point, {0, 0, -1}, {}, false), 0.0f, 1e-6f);
  EXPECT_NEAR(s.at(point, {0, 0, -1}, {}, true), 5.0 / (kPi * 0.81), 1e-4);
}

// Sixteen at a time, the last block not full; some below the side, some turned away, some near, some known otherwise.
TEST(SunlitCorrection, of_many_points_is_the_sum_of_those_of_each) {
  const Lit s;
  std::vector<SunlitPoint> points;
  for (int k = 0; k < 37; ++k) {
    const double a = 0.7 * k, z = 0.9 - 0.045 * k, r = 0.4 + 0.02 * k;
    const glm::dvec3 d(r * std::cos(a), r * std::sin(a), z);
    points.push_back({kVertex + d, glm::normalize(glm::dvec3(0.3, 0.1 * k - 2.0, 0.5) - d),
                      Rgb(1.0f + 0.1f * static_cast<float>(k), 2.0f, 0.5f), 0.02 + 0.01 * (k % 7)});
  }
  const glm::vec3 n = glm::normalize(glm::vec3(0.2f, -0.3f, 0.9f));
  const SenderSide side{&s.open, 0, false, VertexRays::frame(n)};
  const SurfacesKnown known{kVertex + glm::dvec3(0.3, 0.0, 0.2), 0.9};
  Rgb sum(0.0f);
  for (const SunlitPoint& p : points)
    sum += SunlitCorrection({&p, 1}, s.parts, s.windows).at(0, kVertex, side, unshadowed(n), known);
  const Rgb together = SunlitCorrection(points, s.parts, s.windows).at(0, kVertex, side, unshadowed(n), known);
  ASSERT_GT(glm::length(sum), 0.1f);
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(together[c], sum[c], 1e-5f * std::abs(sum[c]) + 1e-6f);
}

TEST(SunlitCorrection, of_what_is_known_otherwise_only_the_share_beyond_counts) {
  const Lit s;
  const SenderSide side{&s.open, 0, false, VertexRays::frame({0, 0, -1})};
  const SunlitPoint point{kVertex - glm::dvec3(0, 0, 0.9), {0, 0, 1}, Rgb(5.0f), 0.1};
  const SunlitCorrection correction({&point, 1}, s.parts, s.windows);
  const float all = correction.at(0, kVertex, side, {}).g;
  for (const double reach : {0.5, 1.0, 1.2, 1.7, 2.0}) {
    const SurfacesKnown known{kVertex, reach};
    EXPECT_NEAR(correction.at(0, kVertex, side, {}, known).g, known.share_beyond(point.position) * all, 1e-5f) << reach;
  }
}

TEST(SunlitCorrection, fades_out_where_the_point_is_near_and_knows_the_room_before_it) {
  const Lit s;
  const auto light = [&](double spacing, const glm::dvec3& to) {
    return s.at({kVertex + to, {0, 0, 1}, Rgb(5.0f), spacing}, {0, 0, -1}, {});
  };
  EXPECT_EQ(light(0.46, {0, 0, -0.9}), 0.0f);
  EXPECT_NEAR(light(0.3, {0, 0, -0.9}), 0.5 * 5.0 / (kPi * 0.81), 1e-4);
  EXPECT_NEAR(light(0.1, {0, 0, -0.9}), 5.0 / (kPi * 0.81), 1e-4);
  EXPECT_EQ(light(0.1, {0, 0, -1.2}), 0.0f) << "below the floor";
}

} // namespace
} // namespace daylit
