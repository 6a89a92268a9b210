#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "radiosity/polygon_kernel.h"

namespace daylit::radiosity {
namespace {

using Quad = std::array<glm::dvec3, 4>;
constexpr double kPi = std::numbers::pi;

/// Directly opposed equal squares, side a, distance c, X = a/c (Howell C-11 summed over corners).
double opposed_squares(double x) {
  const double r = std::sqrt(1 + x * x);
  return 2 / (kPi * x * x) *
         (std::log((1 + x * x) / std::sqrt(1 + 2 * x * x)) + 2 * x * r * std::atan(x / r) - 2 * x * std::atan(x));
}

/// Equal rectangles of common edge w (length) and heights h = l = w at angle phi: reference by adaptive quadrature of
/// the exact point-to-polygon factor over the first rectangle, refined towards the common edge.
double hinge_reference(const Quad& from, const glm::dvec3& normal, const Quad& to) {
  double sum = 0;
  constexpr int kLayers = 40, kAcross = 1000;
  double high = 1.0;
  for (int layer = 0; layer < kLayers; ++layer) {
    const double low = layer + 1 < kLayers ? high * 0.6 : 0.0;
    for (int sub = 0; sub < 4; ++sub) {
      const double v0 = low + (high - low) * sub / 4, v1 = low + (high - low) * (sub + 1) / 4;
      for (const double g : {-0.5773502691896258, 0.5773502691896258})
        for (int k = 0; k < kAcross; ++k) {
          const double u = (k + 0.5) / kAcross, v = 0.5 * (v0 + v1) + 0.5 * g * (v1 - v0);
          const glm::dvec3 p = from[0] + u * (from[1] - from[0]) + v * (from[3] - from[0]);
          sum += 0.5 * (v1 - v0) / kAcross * point_to_polygon(p, normal, to);
        }
    }
    high = low;
  }
  return sum; // unit square: area 1
}

Quad hinged_square(double angle) {
  const glm::dvec3 up(0, std::cos(angle), std::sin(angle));
  return {glm::dvec3(0, 0, 0), up, glm::dvec3(1, 0, 0) + up, glm::dvec3(1, 0, 0)};
}

TEST(PolygonKernel, point_below_corner_of_parallel_rectangle_matches_closed_form) {
  // F = (1/2pi)[A/sqrt(1+A^2) atan(B/sqrt(1+A^2)) + B/sqrt(1+B^2) atan(A/sqrt(1+B^2))], A = a/c, B = b/c.
  const double a = 2, b = 1, c = 3, A = a / c, B = b / c;
  const Quad ceiling = {glm::dvec3(0, 0, c), glm::dvec3(0, b, c), glm::dvec3(a, b, c), glm::dvec3(a, 0, c)};
  const double ra = std::sqrt(1 + A * A), rb = std::sqrt(1 + B * B);
  const double expected = (A / ra * std::atan(B / ra) + B / rb * std::atan(A / rb)) / (2 * kPi);
  EXPECT_NEAR(point_to_polygon({0, 0, 0}, {0, 0, 1}, ceiling), expected, 1e-14);
}

TEST(PolygonKernel, polygon_through_the_horizon_counts_only_its_upper_part) {
  const Quad wall = {glm::dvec3(-1, 1, -5), glm::dvec3(1, 1, -5), glm::dvec3(1, 1, 2), glm::dvec3(-1, 1, 2)};
  const Quad upper = {glm::dvec3(-1, 1, 0), glm::dvec3(1, 1, 0), glm::dvec3(1, 1, 2), glm::dvec3(-1, 1, 2)};
  EXPECT_NEAR(point_to_polygon({0, 0, 0}, {0, 0, 1}, wall), point_to_polygon({0, 0, 0}, {0, 0, 1}, upper), 1e-14);
}

TEST(PolygonKernel, opposed_squares_match_closed_form_at_every_distance) {
  for (const double distance : {0.01, 0.1, 0.5, 1.0, 3.0, 10.0, 100.0}) {
    const Quad low = {glm::dvec3(0, 0, 0), glm::dvec3(1, 0, 0), glm::dvec3(1, 1, 0), glm::dvec3(0, 1, 0)};
    const Quad high = {glm::dvec3(0, 0, distance), glm::dvec3(0, 1, distance), glm::dvec3(1, 1, distance),
                       glm::dvec3(1, 0, distance)};
    const double expected = opposed_squares(1.0 / distance);
    EXPECT_NEAR(exchange_area_unoccluded(low, {0, 0, 1}, high, {0, 0, -1}) / expected, 1.0, 1e-5) << distance;
  }
}

TEST(PolygonKernel, touching_squares_at_90_and_5_degrees_match_reference) {
  const Quad floor = {glm::dvec3(0, 0, 0), glm::dvec3(1, 0, 0), glm::dvec3(1, 1, 0), glm::dvec3(0, 1, 0)};
  // Twelve clustered nodes per edge piece: 1e-4 where the far edges run almost parallel at 5 degrees, 2e-5 above.
  for (const double degrees : {90.0, 30.0, 5.0}) {
    const double angle = degrees * kPi / 180;
    const Quad plate = hinged_square(angle);
    const glm::dvec3 normal(0, std::sin(angle), -std::cos(angle)); // towards the floor square
    EXPECT_NEAR(exchange_area_unoccluded(floor, {0, 0, 1}, plate, normal) / hinge_reference(floor, {0, 0, 1}, plate),
                1.0, degrees < 10 ? 2e-4 : 2e-5)
        << degrees;
  }
  // Howell C-14 for two unit squares with a common edge at 90 degrees: 0.2000437761...
  const Quad wall = hinged_square(kPi / 2);
  EXPECT_NEAR(exchange_area_unoccluded(floor, {0, 0, 1}, wall, {0, 1, 0}), 0.2000437, 1e-6);
}

TEST(PolygonKernel, is_symmetric_and_invariant_under_scale_and_rotation) {
  const std::array<glm::dvec3, 3> a = {glm::dvec3(0, 0, 0), glm::dvec3(1, 0, 0), glm::dvec3(0.2, 0.9, 0)};
  const std::array<glm::dvec3, 3> b = {glm::dvec3(0, 0, 0.4), glm::dvec3(0.3, 1.1, 0.7), glm::dvec3(1, 0.1, 0.9)};
  const glm::dvec3 na(0, 0, 1), nb = glm::normalize(glm::cross(b[1] - b[0], b[2] - b[0]));
  const double ab = exchange_area_unoccluded(a, na, b, nb);
  EXPECT_GT(ab, 0.01);
  EXPECT_NEAR(exchange_area_unoccluded(b, nb, a, na) / ab, 1.0, 1e-6);
  auto scaled = [](std::array<glm::dvec3, 3> t) {
    for (glm::dvec3& p : t)
      p = 1000.0 * glm::dvec3(p.z, p.x, p.y);
    return t;
  };
  const double big = exchange_area_unoccluded(scaled(a), {1, 0, 0}, scaled(b), {nb.z, nb.x, nb.y});
  EXPECT_NEAR(big * 1e-6 / ab, 1.0, 1e-9);
}

TEST(PolygonKernel, interior_of_a_cube_closes) {
  // Every face of a closed unit cube sees the five others: the factors sum to 1.
  const Quad floor = {glm::dvec3(0, 0, 0), glm::dvec3(1, 0, 0), glm::dvec3(1, 1, 0), glm::dvec3(0, 1, 0)};
  const Quad ceiling = {glm::dvec3(0, 0, 1), glm::dvec3(0, 1, 1), glm::dvec3(1, 1, 1), glm::dvec3(1, 0, 1)};
  const Quad south = {glm::dvec3(0, 0, 0), glm::dvec3(0, 0, 1), glm::dvec3(1, 0, 1), glm::dvec3(1, 0, 0)};
  const double sum = exchange_area_unoccluded(floor, {0, 0, 1}, ceiling, {0, 0, -1}) +
                     4 * exchange_area_unoccluded(floor, {0, 0, 1}, south, {0, 1, 0});
  EXPECT_NEAR(sum, 1.0, 2e-6);
}

} // namespace
} // namespace daylit::radiosity
