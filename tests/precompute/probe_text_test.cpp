#include "precompute/probe_text.h"

#include <cmath>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/scene/test_volumes.h"

namespace daylit::precompute {
namespace {

TEST(ProbeText, point_and_normal_are_read_and_the_normal_becomes_unit) {
  const auto point = parse_probe_point("1 -2.5e0\t+3  0 0 -4\r", 1, true);
  ASSERT_TRUE(point) << point.error().message();
  EXPECT_EQ(point->position, glm::dvec3(1, -2.5, 3));
  EXPECT_EQ(point->normal, glm::dvec3(0, 0, -1));
  EXPECT_TRUE(parse_probe_point("1e6 2 3", 1, false));
}

TEST(ProbeText, bad_lines_are_refused_with_their_number) {
  for (const char* line : {"", "1 2 3", "1 2 3 0 0", "1 2 3 0 0 1 7", "1 2 3 0 0 0", "a 2 3 0 0 1", "1 2 nan 0 0 1",
                           "1 2 3 0 inf 1", "1,2,3,0,0,1", "1 2 3 0 0 1x", "1 2 1e999 0 0 1", "+ 2 3 0 0 1"}) {
    const auto point = parse_probe_point(line, 17, true);
    ASSERT_FALSE(point) << line;
    EXPECT_NE(point.error().message().find("line 17"), std::string::npos) << line;
  }
  EXPECT_FALSE(parse_probe_point("1 2 3 0 0 1", 1, false)) << "--sh takes no normal";
}

TEST(ProbeText, printed_numbers_read_back_as_the_same_floats) {
  const Rgb e(1.0f / 3.0f, 1e-20f, 12345.678f);
  float r = 0, g = 0, b = 0;
  ASSERT_EQ(std::sscanf(irradiance_text(e, false).c_str(), "%f %f %f\n", &r, &g, &b), 3);
  EXPECT_EQ(Rgb(r, g, b), e);
  const auto json = nlohmann::json::parse(irradiance_text(e, true));
  EXPECT_EQ(json["irradiance"][2].get<float>(), e.b);
}

TEST(ProbeText, outside_is_nan_in_text_and_null_in_json) {
  EXPECT_EQ(irradiance_text(std::nullopt, false), "nan nan nan\n");
  EXPECT_TRUE(nlohmann::json::parse(irradiance_text(std::nullopt, true))["irradiance"].is_null());
  EXPECT_TRUE(nlohmann::json::parse(coefficients_text(std::nullopt, true))["sh"].is_null());
  for (const bool json : {false, true}) {
    EXPECT_TRUE(is_outside(irradiance_text(std::nullopt, json), json));
    EXPECT_TRUE(is_outside(coefficients_text(std::nullopt, json), json));
    EXPECT_FALSE(is_outside(irradiance_text(Rgb(1), json), json));
  }
}

TEST(ProbeText, coefficients_are_printed_coefficient_major) {
  Sh9Rgb sh{};
  for (int i = 0; i < 27; ++i)
    sh[i / 3][i % 3] = static_cast<float>(i);
  std::string expected;
  for (int i = 0; i < 27; ++i)
    expected.append(i ? " " : "").append(std::to_string(i));
  EXPECT_EQ(coefficients_text(sh, false), expected + "\n");
  ShRadiance all{sh, {}};
  for (int i = 27; i < 54; ++i) {
    all.band4[i / 3 - 9][i % 3] = static_cast<float>(i);
    expected += " " + std::to_string(i);
  }
  EXPECT_EQ(order4_text(all, false), expected + "\n");
  EXPECT_TRUE(is_outside(order4_text(std::nullopt, true), true));
}

TEST(ProbeText, info_states_what_the_volume_holds) {
  BasisVolume volume = test::grid_volume(test::closed_room(), {4, 5, 3}, 7);
  volume.provenance.report_json = R"({"facets": 3})";
  const auto info = nlohmann::json::parse(volume_info(volume));
  EXPECT_EQ(info["sky"]["regions"], 64);
  EXPECT_EQ(info["sky"]["stored"], 7);
  EXPECT_EQ(info["probes"]["count"], 60);
  EXPECT_EQ(info["report"]["facets"], 3);
  EXPECT_EQ(info["sh_order"], 2);
  volume.band4 = volume.basis;
  EXPECT_EQ(nlohmann::json::parse(volume_info(volume))["sh_order"], 4);
}

TEST(ProbeText, illuminance_weighs_the_channels_and_scales) {
  EXPECT_NEAR(illuminance(Rgb(1.0f), kLumensPerWatt), 179.0, 1e-4); // the three weights sum to 1
  EXPECT_NEAR(illuminance({0, 2, 0}, 1.0), 2 * 0.7152, 1e-7);
  EXPECT_EQ(illuminance_text(Rgb(2.0f), 100.0, false), "200\n");
  EXPECT_EQ(illuminance_text(std::nullopt, 1.0, false), "nan\n");
  EXPECT_TRUE(is_outside(illuminance_text(std::nullopt, 1.0, true), true));
}

} // namespace
} // namespace daylit::precompute
