// The bake at given points, without a grid: what is left is the error of the transport itself.

#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>

#include <gtest/gtest.h>

#include "precompute/room_frame.h"
#include "tests/simulate/truth_cases.h"

namespace daylit {
namespace {

/// The nine true coefficients at the 33 points, coefficient-major: [point * 9 + l * l + l + m].
std::vector<Rgb> true_coefficients(const std::string& scene, const std::string& sky) {
  std::ifstream file(test::kTruthFolder / "truth_sh9.csv");
  std::vector<Rgb> values;
  for (std::string line; std::getline(file, line);) {
    std::vector<std::string> cell;
    std::stringstream stream(line);
    for (std::string c; std::getline(stream, c, ',');)
      cell.push_back(c);
    if (cell.size() == 14 && cell[0] == scene && cell[1] == sky)
      values.push_back(Rgb(std::stof(cell[8]), std::stof(cell[9]), std::stof(cell[10])));
  }
  return values;
}

struct Errors {
  double coefficients = 0, irradiance = 0;
  precompute::BakeReport report;
};

Result<Errors> errors_at_points(const std::string& scene, const std::string& sky_name, precompute::BakeOptions options,
                                const std::string& regions) {
  const auto rows = test::truth_rows(scene, sky_name, "indirect");
  for (std::size_t i = 0; i < rows.size(); i += 6)
    options.points.push_back(rows[i].receiver.position);
  const auto room = read_room(test::kTruthFolder / (scene == "S1" ? "s1_daylit_cornell.obj" : "s3_furnace.obj"));
  const auto partition = SkyPartition::parse(regions);
  const auto sky = test::truth_sky(sky_name);
  if (!room || !partition || !sky)
    return Error{ErrorCode::io, "the fixture cannot be read", scene, ""};
  Errors errors;
  const auto volume = precompute::bake_room(
      *room, *partition, options, [](const std::string&, double) { return true; }, errors.report);
  if (!volume)
    return volume.error();
  const LightField field = combine(*volume, region_radiance(*sky, volume->partition));
  const auto truth = true_coefficients(scene, sky_name);
  EXPECT_EQ(truth.size(), 9 * options.points.size());
  const auto coefficient = [&](std::size_t i) { return field.probe[i / 9][i % 9]; };
  errors.coefficients = test::nrms(truth.size(), coefficient, [&](std::size_t i) { return truth[i]; });
  const auto received = [&](std::size_t i) {
    return irradiance(field.probe[i / 6], glm::vec3(rows[i].receiver.normal));
  };
  errors.irradiance = test::nrms(rows.size(), received, [&](std::size_t i) { return rows[i].value; });
  return errors;
}

void expect_errors(const precompute::BakeOptions& options, const std::string& regions, double coefficients,
                   double irradiance) {
  for (const auto& [scene, sky] : {std::pair("S1", "E1"), {"S1", "E2"}, {"S3", "E1"}}) {
    const auto e = errors_at_points(scene, sky, options, regions);
    ASSERT_TRUE(e) << e.error().message();
    std::printf("%s/%s %5zu facets, %s: coefficients %.3f %%, irradiance %.3f %% nrms, rows close to %.1e\n", scene,
                sky, e->report.facets, regions.c_str(), 100 * e->coefficients, 100 * e->irradiance,
                e->report.closure.worst);
    EXPECT_LE(e->coefficients, coefficients);
    EXPECT_LE(e->irradiance, irradiance);
    EXPECT_LE(e->report.energy.imbalance, 1e-4);
    EXPECT_LE(e->report.closure.worst, 1e-3);
  }
}

TEST(GivenPoints, two_thousand_facets_are_within_1_6_and_2_percent) {
  precompute::BakeOptions options = *precompute::quality_options("normal", true);
  options.target_facets = 2000;
  expect_errors(options, "uniform:256", 0.016, 0.02);
}

TEST(GivenPoints, normal_quality_is_within_1_and_1_5_percent) {
  expect_errors(*precompute::quality_options("normal", true), "uniform:256", 0.010, 0.015);
}

/// Points all over a room have little in common: as one cluster these lose 4.8 %.
TEST(GivenPoints, far_apart_keep_the_fine_sky_as_exactly_as_asked) {
  precompute::BakeOptions options = *precompute::quality_options("draft", true);
  options.compact_error = 0.014;
  for (int i = 0; i < 168; ++i)
    options.points.push_back({0.1 + 0.0226 * (i * 37 % 168), 0.1 + 0.0286 * (i * 71 % 168), 0.1 + 0.0155 * i});
  const auto room = read_room(test::kTruthFolder / "s1_daylit_cornell.obj");
  ASSERT_TRUE(room) << room.error().message();
  precompute::BakeReport report;
  const auto volume = precompute::bake_room(
      *room, *SkyPartition::parse("fine:4096"), options, [](const std::string&, double) { return true; }, report);
  ASSERT_TRUE(volume) << volume.error().message();
  std::printf("%zu clusters of points, %.2f %% rms\n", report.compact.probe_clusters, 100 * report.compact.rms_error);
  EXPECT_LE(report.compact.rms_error, 1.5 * options.compact_error);
}

} // namespace
} // namespace daylit
