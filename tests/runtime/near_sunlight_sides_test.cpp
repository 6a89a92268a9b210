// What a sun patch on the floor sends to each side of an object near it, by the integral over the patch.

#include "runtime/indirect/near_sunlight.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "sunny_floor.h"

namespace daylit {
namespace {

using test::kPlaces;
using test::kY1;
using test::Rectangle;
using test::sum;
using test::SunnyFloor;

/// Irradiance by the nine coefficients, and what they miss of it.
double irradiance_at(const SunnyFloor& floor, std::size_t v, const Sh9Rgb& light, bool back = false) {
  const VertexTransfer& transfer = floor.objects.senders.transfer[v];
  float e = floor.near.missed(v, back).g;
  for (std::size_t i = 0; i < 9; ++i)
    e += light[i].g * (back ? transfer.back : transfer.front)[i];
  return static_cast<double>(e);
}

/// E = integral of L (n d)+ z / |y - x|^4 over a part of the patch, by squares of 5 mm.
double patch_irradiance(const Rectangle& lit, const glm::dvec3& x, const glm::dvec3& n) {
  constexpr double kStep = 0.005;
  double sum = 0;
  for (double a = double(lit.x0) + 0.5 * kStep; a < double(lit.x1); a += kStep)
    for (double b = double(lit.y0) + 0.5 * kStep; b < double(lit.y1); b += kStep) {
      const glm::dvec3 d = glm::dvec3(a, b, 0.0) - x;
      const double distance = glm::length(d);
      sum += std::max(0.0, glm::dot(n, d)) * kStep * kStep * x.z / std::pow(distance, 4.0);
    }
  return sum * static_cast<double>(SunnyFloor::patch_radiance().g);
}

/// A folded card, 1 m along x, 0.1 m high and wide: two sheets that touch at the top; fronts outside.
ObjectMesh tent() {
  ObjectMesh mesh;
  for (const float side : {-1.0f, 1.0f}) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const glm::vec3 normal = glm::normalize(glm::vec3(0.0f, side, 0.5f));
    for (std::uint32_t j = 0; j < 6; ++j)
      for (std::uint32_t i = 0; i < 21; ++i) {
        const float up = 0.2f * static_cast<float>(j);
        mesh.positions.emplace_back(-0.5f + 0.05f * static_cast<float>(i), 0.05f * side * (1.0f - up), 0.1f * up);
        mesh.normals.push_back(normal);
        mesh.reflectance.emplace_back(0.5f);
        if (i == 0 || j == 0)
          continue;
        const std::uint32_t v = first + 21 * j + i, w = v - 21;
        mesh.triangles.push_back(side > 0 ? std::array{v, w, v - 1} : std::array{v, v - 1, w});
        mesh.triangles.push_back(side > 0 ? std::array{w, w - 1, v - 1} : std::array{w, v - 1, w - 1});
      }
  }
  return mesh;
}

TEST(NearSunlight, the_inside_of_a_card_beside_the_patch_stays_dark) {
  const Rectangle lit_part{1.75f, 2.25f, 3.25f, 3.5f}; // all of it near the card
  SunnyFloor floor({kPlaces[0]}, {1.75f, 2.25f, 3.25f, 3.75f});
  floor.stand_at({{2.0, kY1 + 0.05, 0.0}}, SunnyFloor::model_of(tent()), 1, true);
  const std::vector<Sh9Rgb> light = sum(floor.base(), floor.correction());
  const double lit = test::kPi * static_cast<double>(SunnyFloor::patch_radiance().g);
  double brightest_foot = 0;
  for (std::size_t v = 0; v < light.size(); ++v) {
    const glm::dvec3& x = floor.at()[v];
    if (std::abs(x.x - 2.0) < 0.3) { // light comes in at the ends
      EXPECT_NEAR(irradiance_at(floor, v, light[v], true), 0.0, 0.035 * lit) << x.y - kY1 << ", height " << x.z;
    }
    if (x.z > 0.01)
      EXPECT_NEAR(irradiance_at(floor, v, light[v]),
                  patch_irradiance(lit_part, x, glm::dvec3(floor.objects.senders.surface.normals[v])), 0.02 * lit)
          << "outside, height " << x.z;
    else
      brightest_foot = std::max(brightest_foot, irradiance_at(floor, v, light[v]));
  }
  const double floor_share = 0.5 * (1.0 - 1.0 / std::sqrt(5.0)); // of what the outside sees, which leans by atan 1/2
  EXPECT_NEAR(brightest_foot, floor_share * lit, 0.03 * lit);
}

} // namespace
} // namespace daylit
