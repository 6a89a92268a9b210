// The oracle against the published reference values (Radiance and Cycles, own error 0.06-0.15 % of the indirect light).

#include <cstdio>
#include <ostream>
#include <string>

#include <gtest/gtest.h>

#include "tests/simulate/truth_cases.h"

namespace daylit {
namespace {

using test::nrms;
using test::truth_rows;

constexpr double kBar = 0.005;

struct Case {
  const char *scene, *sky;
  int samples; // enough for an own error of about 0.35 %
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.scene << '/' << c.sky; }

class OracleTruth : public testing::TestWithParam<Case> {};

TEST_P(OracleTruth, indirect_and_total_irradiance_are_within_half_a_percent) {
  const Case c = GetParam();
  const auto indirect_truth = truth_rows(c.scene, c.sky, "indirect"), total_truth = truth_rows(c.scene, c.sky, "total");
  ASSERT_EQ(indirect_truth.size(), 198u);
  ASSERT_EQ(total_truth.size(), 198u);
  const auto scene = test::truth_scene(c.scene, c.sky);
  ASSERT_TRUE(scene) << scene.error().message();
  std::vector<Receiver> receivers;
  for (const auto& row : indirect_truth)
    receivers.push_back(row.receiver);

  const auto indirect = trace_irradiance(*scene, receivers, {.samples = c.samples, .indirect = true, .direct = false});
  const auto direct = trace_irradiance(*scene, receivers, {.samples = 1024, .indirect = false, .direct = true});
  ASSERT_TRUE(indirect && direct);

  const auto reference = [](const auto& rows) { return [&rows](std::size_t i) { return rows[i].value; }; };
  const auto traced = [&](std::size_t i) { return (*indirect)[i].value; };
  const auto total = [&](std::size_t i) { return (*indirect)[i].value + (*direct)[i].value; };
  const auto own = [&](std::size_t i) { return indirect_truth[i].value + (*indirect)[i].standard_error; };
  const double indirect_error = nrms(198, traced, reference(indirect_truth));
  const double total_error = nrms(198, total, reference(total_truth));
  std::printf("%s/%s: indirect %.3f %% (own standard error %.3f %%), total %.3f %%\n", c.scene, c.sky,
              100.0 * indirect_error, 100.0 * nrms(198, own, reference(indirect_truth)), 100.0 * total_error);
  EXPECT_LE(indirect_error, kBar);
  EXPECT_LE(total_error, kBar);
}

INSTANTIATE_TEST_SUITE_P(Cases, OracleTruth,
                         testing::Values(Case{"S1", "E1", 8192}, Case{"S1", "E2", 16384}, Case{"S3", "E1", 4096}),
                         [](const auto& c) { return std::string(c.param.scene) + "_" + c.param.sky; });

} // namespace
} // namespace daylit
