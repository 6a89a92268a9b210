// Closed forms of daylighting against the libraries. Derivations stand at the cases (bench/selftest) and at the
// formulas (bench/selftest/reference.h); here the formulas are checked against values published or derived elsewhere,
// and every case has to come within its tolerance.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "bench/selftest/closed_form_cases.h"
#include "bench/selftest/reference.h"
#include "scene/room/glass.h"

namespace daylit::bench {
namespace {

constexpr double kPi = std::numbers::pi, kDegree = kPi / 180;
const Progress kSilent = [](const std::string&, double) { return true; };

constexpr int kFacets = 2000; ///< those of `normal`, held to the tolerance of `high`: the tests stay short

void expect_within(const std::string& name, const std::string& quality_name, int facets = 0) {
  SelftestQuality quality = *selftest_quality(quality_name);
  if (facets > 0)
    quality.facets = facets;
  const std::vector<ClosedFormCase> all = closed_form_cases();
  const auto found = std::ranges::find_if(all, [&](const ClosedFormCase& c) { return c.name == name; });
  ASSERT_NE(found, all.end()) << name;
  const auto list = found->run(quality, kSilent);
  ASSERT_TRUE(list) << list.error().message();
  ASSERT_FALSE(list->empty());
  for (const Comparison& c : *list)
    EXPECT_LE(std::abs(c.deviation()), quality.tolerance) << c.what << ": " << c.result << " for " << c.reference;
}

TEST(Reference, form_factors_have_their_published_values) {
  EXPECT_NEAR(perpendicular_factor({0, 4}, {-2, 2}, 2), 0.190136, 1e-6);
  EXPECT_NEAR(parallel_factor({-2, 2}, {-2, 2}, 3), 0.357685, 1e-6);
  EXPECT_NEAR(perpendicular_factor({0, 500}, {-250, 250}, 2), 0.496863, 1e-6);
  EXPECT_NEAR(parallel_factor({-250, 250}, {-250, 250}, 3), 0.999882, 2e-6);
  EXPECT_NEAR(opposed_rectangles(1, 1, 1), 0.199825, 1e-6);
  EXPECT_NEAR(hinged_rectangles(1, 1, 1), 0.200044, 1e-6);
}

TEST(Reference, mean_over_a_rectangle_of_point_factors_is_the_factor_between_rectangles) {
  double parallel = 0, hinged = 0;
  const GaussRule& rule = gauss_rule();
  for (std::size_t i = 0; i < rule.node.size(); ++i)
    for (std::size_t j = 0; j < rule.node.size(); ++j) {
      const double x = 4 * rule.node[i], y = 3 * rule.node[j], w = rule.weight[i] * rule.weight[j];
      parallel += w * parallel_factor({-x, 4 - x}, {-y, 3 - y}, 2.5);
      hinged += w * perpendicular_factor({0, 2.5}, {-x, 4 - x}, y);
    }
  EXPECT_NEAR(parallel, opposed_rectangles(4, 3, 2.5), 1e-9);
  EXPECT_NEAR(hinged, hinged_rectangles(4, 3, 2.5), 1e-5); // the integrand has a kink where the rectangles meet
}

TEST(Reference, sky_components_of_a_roof_opening_have_their_published_values) {
  const glm::dvec3 up(0, 0, 1), sun(std::sin(40 * kDegree), 0, std::cos(40 * kDegree));
  const GeneralSky type1{4, -0.7, 0, -1, 0}, type12{-1, -0.32, 10, -3, 0.45, sun};
  const auto percent = [&](const RadianceOf& sky, const glm::dvec3& p, double side) {
    return 100 * rectangle_irradiance(p, up, {2 - side / 2, 2 - side / 2, 3}, {side, 0, 0}, {0, side, 0}, sky) /
           horizontal_irradiance(sky);
  };
  const RadianceOf cie1 = [&](const glm::dvec3& w) { return type1.radiance(w); };
  const RadianceOf cie12 = [&](const glm::dvec3& w) { return type12.radiance(w); };
  const glm::dvec3 centre(2, 2, 0), side(0.5, 2, 0);
  EXPECT_NEAR(percent(overcast_radiance, centre, 1), 4.3590, 1e-4);
  EXPECT_NEAR(percent(cie1, centre, 1), 4.3559, 1e-4);
  EXPECT_NEAR(percent(cie12, centre, 1), 2.5494, 1e-4);
  EXPECT_NEAR(percent(overcast_radiance, centre, 4), 42.9959, 1e-4);
  EXPECT_NEAR(percent(cie1, centre, 4), 43.587, 1e-3);
  EXPECT_NEAR(percent(cie12, centre, 4), 31.239, 1e-3);
  EXPECT_NEAR(percent(overcast_radiance, side, 1), 2.6736, 1e-4);
  EXPECT_NEAR(percent(cie12, side, 1), 4.5032, 1e-4);
  EXPECT_NEAR(percent(cie12, side, 4), 39.692, 1e-3);
}

TEST(Reference, sky_components_of_a_facade_opening_have_their_published_values_and_agree_with_quadrature) {
  const std::array<double, 3> uniform = {7.8667, 4.3238, 2.0833}, overcast = {8.5826, 3.9816, 1.6797};
  for (int k = 0; k < 3; ++k) {
    const double d = k + 1.0, sc = 200 * (overcast_sky_component(1, 2, d) - overcast_sky_component(1, 1, d));
    EXPECT_NEAR(100 * perpendicular_factor({1, 2}, {-1, 1}, d), uniform[k], 1e-4);
    EXPECT_NEAR(sc, overcast[k], 1e-4);
    const double e = rectangle_irradiance({0, d, 0}, {0, 0, 1}, {-1, 0, 1}, {2, 0, 0}, {0, 0, 1}, overcast_radiance);
    EXPECT_NEAR(100 * e / (7 * kPi / 9), sc, 1e-9);
  }
}

TEST(Reference, clear_glass_has_its_published_transmittance) {
  const double normal = slab_transmittance_series(0, 1.52);
  EXPECT_NEAR(normal, 0.91832, 1e-5);
  const std::array<std::array<double, 2>, 5> ratio = {
      {{30, 0.9974}, {45, 0.9828}, {60, 0.9185}, {75, 0.6695}, {85, 0.2675}}};
  for (const auto& [degrees, expected] : ratio)
    EXPECT_NEAR(slab_transmittance_series(degrees * kDegree, 1.52) / normal, expected, 5e-5) << degrees;
}

TEST(Glass, closed_form_of_the_slab_is_the_sum_of_all_internal_reflections) {
  for (double degrees = 0; degrees < 90; degrees += 0.5)
    EXPECT_NEAR(clear_slab_transmittance(std::cos(degrees * kDegree), 1.52),
                slab_transmittance_series(degrees * kDegree, 1.52), 1e-12)
        << degrees;
  EXPECT_EQ(clear_slab_transmittance(0.0, 1.52), 0.0);
  EXPECT_EQ(clear_slab_transmittance(0.4, 1.0), 1.0);
  double diffuse = 0.0; // of a uniform sky: midpoints in sin^2 of the angle, in which the cosine weight is constant
  for (int k = 0; k < 4096; ++k)
    diffuse += clear_slab_transmittance(std::sqrt(1.0 - (k + 0.5) / 4096), 1.52) / 4096;
  EXPECT_NEAR(diffuse, 0.846423, 1e-5);
}

TEST(ClosedForm, flux_through_an_opening_is_absorbed_or_leaves) { expect_within("CIE 171 5.4", "high", kFacets); }
TEST(ClosedForm, clear_glass_transmits_by_angle) { expect_within("CIE 171 5.5", "high"); }
TEST(ClosedForm, roof_opening_shows_its_part_of_the_sky) { expect_within("CIE 171 5.9", "high"); }
TEST(ClosedForm, roof_glass_multiplies_the_integrand) { expect_within("CIE 171 5.10", "high"); }
TEST(ClosedForm, facade_opening_shows_sky_and_ground) { expect_within("CIE 171 5.11", "high"); }
TEST(ClosedForm, facade_glass_multiplies_the_integrand) { expect_within("CIE 171 5.12", "high"); }
TEST(ClosedForm, area_source_lights_by_its_form_factor) { expect_within("CIE 171 5.3", "high", kFacets); }
TEST(ClosedForm, lit_floor_lights_by_its_form_factor) { expect_within("CIE 171 5.6", "high", kFacets); }
TEST(ClosedForm, hidden_part_of_the_floor_gives_no_light) { expect_within("CIE 171 5.7", "high", kFacets); }
TEST(ClosedForm, closed_cube_has_the_mean_of_its_flux) { expect_within("CIE 171 5.8", "high", kFacets); }
TEST(ClosedForm, furnace_reads_one_over_one_minus_reflectance) { expect_within("furnace", "high", kFacets); }
TEST(ClosedForm, faces_of_a_box_exchange_as_parallel_and_perpendicular_plates) {
  expect_within("box faces", "high", kFacets);
}
TEST(ClosedForm, endless_plates_send_light_to_and_fro) { expect_within("endless plates", "high", kFacets); }
TEST(ClosedForm, box_in_a_box_exchanges_by_areas) { expect_within("box in box", "high", kFacets); }
TEST(ClosedForm, long_duct_obeys_crossed_strings) { expect_within("crossed strings", "high", kFacets); }

} // namespace
} // namespace daylit::bench
