// Radiance between the corners of elements.

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "scene/volume/linear_radiance.h"

namespace daylit {
namespace {

using Element = FirstReflection::Element;

Element element(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& normal) {
  Element e;
  e.corner = {a, b, c};
  e.middle = (a + b + c) / 3.0;
  e.normal = normal;
  e.radius_m = 0.1;
  return e;
}

/// A square of 4 x 4 cells, two elements each, at z = 0; and one element of a wall at x = 0 on its edge.
std::vector<Element> floor_and_wall() {
  std::vector<Element> all;
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 4; ++y) {
      const glm::dvec3 a(x, y, 0), b(x + 1, y, 0), c(x + 1, y + 1, 0), d(x, y + 1, 0);
      all.push_back(element(a, b, c, {0, 0, 1}));
      all.push_back(element(a, c, d, {0, 0, 1}));
    }
  all.push_back(element({0, 1, 0}, {0, 2, 0}, {0, 1, 1}, {1, 0, 0}));
  return all;
}

float slope(const glm::dvec3& p) { return static_cast<float>(1.0 + 0.5 * p.x + 0.25 * p.y); }

std::vector<Rgb> means(const std::vector<Element>& all) {
  std::vector<Rgb> mean;
  for (const Element& e : all)
    mean.emplace_back(e.normal.z > 0 ? slope(e.middle) : 50.0f);
  return mean;
}

TEST(LinearRadiance, a_linear_field_is_given_back_within_the_border) {
  const auto all = floor_and_wall();
  const LinearRadiance light(all, means(all));
  for (std::size_t e = 0; e < all.size(); ++e)
    for (const glm::dvec3& p : {all[e].middle, 0.7 * all[e].corner[0] + 0.3 * all[e].corner[1]})
      if (all[e].middle.x > 1 && all[e].middle.x < 3 && all[e].middle.y > 1 && all[e].middle.y < 3) {
        EXPECT_NEAR(light.at(e, all[e], p).g, slope(p), 1e-5f) << e;
      }
}

TEST(LinearRadiance, an_element_keeps_its_mean) {
  const auto all = floor_and_wall();
  const auto mean = means(all);
  const LinearRadiance light(all, mean);
  for (std::size_t e = 0; e < all.size(); ++e) {
    Rgb sum(0.0f);
    for (const auto& corner : all[e].corner)
      sum += light.at(e, all[e], corner) / 3.0f;
    EXPECT_NEAR(sum.g, mean[e].g, 1e-4f) << e;
  }
}

TEST(LinearRadiance, surfaces_that_meet_at_an_edge_do_not_mix) {
  const auto all = floor_and_wall();
  const LinearRadiance light(all, means(all));
  EXPECT_NEAR(light.at(all.size() - 1, all.back(), {0, 1, 0}).g, 50.0f, 1e-4f);
  for (std::size_t e = 0; e + 1 < all.size(); ++e)
    EXPECT_LT(light.at(e, all[e], all[e].corner[0]).g, 10.0f);
}

TEST(LinearRadiance, materials_of_one_plane_do_not_mix) {
  auto all = floor_and_wall();
  std::vector<Rgb> mean(all.size(), Rgb(1.0f));
  for (std::size_t e = 0; e < all.size(); ++e)
    if (all[e].middle.x > 2) {
      all[e].reflectance = Rgb(0.8f);
      mean[e] = Rgb(4.0f);
    }
  const LinearRadiance light(all, mean);
  for (std::size_t e = 0; e < all.size(); ++e)
    for (const auto& corner : all[e].corner)
      EXPECT_NEAR(light.at(e, all[e], corner).g, mean[e].g, 1e-5f) << e;
}

/// A thin wall stands between them, which nobody knows here.
TEST(LinearRadiance, a_dark_element_beside_a_bright_one_keeps_its_mean_and_is_not_negative) {
  const std::vector<Element> two{element({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}),
                                 element({1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1})};
  const LinearRadiance light(two, std::vector<Rgb>{Rgb(0.01f, 0.01f, 0.0f), Rgb(9.0f)});
  Rgb sum(0.0f);
  for (const auto& corner : two[0].corner) {
    const Rgb here = light.at(0, two[0], corner);
    EXPECT_GE(here.g, 0.0f);
    EXPECT_LE(here.g, 0.0301f);
    EXPECT_EQ(here.b, 0.0f);
    sum += here / 3.0f;
  }
  EXPECT_NEAR(sum.g, 0.01f, 1e-6f);
}

} // namespace
} // namespace daylit
