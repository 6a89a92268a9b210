// Regions where the volume changes: the cuts on responses whose best cuts are known, and one real room.

#include <gtest/gtest.h>

#include "precompute/adaptive_sky.h"
#include "precompute/room_frame.h"
#include "scene/volume/volume_file.h"

namespace daylit::precompute {
namespace {

constexpr int kBands = 64, kCells = 128;

bool silent(const std::string&, double) { return true; }

/// Squared difference of cells to the mean of their region.
double squared_change(const SkyPartition& p, const std::vector<float>& response) {
  std::vector<double> sum(static_cast<std::size_t>(p.size())), count(sum.size()), square(sum.size());
  for (int cell = 0; cell < kBands * kCells; ++cell) {
    const auto r = static_cast<std::size_t>(p.region_of_cell(cell));
    const double x = static_cast<double>(response[static_cast<std::size_t>(cell)]);
    sum[r] += x;
    square[r] += x * x;
    count[r] += 1;
  }
  double total = 0;
  for (std::size_t r = 0; r < sum.size(); ++r)
    total += square[r] - sum[r] * sum[r] / count[r];
  return total;
}

TEST(AdaptiveSky, six_regions_are_enough_for_a_bright_rectangle_in_a_dark_half) {
  std::vector<float> response(kBands * kCells, 0.0f);
  for (int b = 40; b < 47; ++b)
    for (int c = 17; c < 30; ++c)
      response[static_cast<std::size_t>(b * kCells + c)] = 3.0f;
  const auto p = cut_where_it_changes(response, 1, 1000);
  ASSERT_TRUE(p) << p.error().message();
  EXPECT_EQ(p->size(), 6); // four cuts, and the half below the horizon; nothing changes within any of them
  EXPECT_NEAR(squared_change(*p, response), 0.0, 1e-9);
}

TEST(AdaptiveSky, nothing_is_cut_where_nothing_comes_in) {
  const auto p = cut_where_it_changes(std::vector<float>(kBands * kCells, 0.0f), 1, 256);
  ASSERT_TRUE(p);
  EXPECT_EQ(p->size(), 2);
}

TEST(AdaptiveSky, every_further_region_lowers_the_change) {
  std::vector<float> response;
  for (int i = 0; i < kBands * kCells; ++i)
    response.push_back(std::sin(0.2f * static_cast<float>(i / kCells)) *
                       std::cos(0.1f * static_cast<float>(i % kCells)));
  double before = 1e30;
  for (int n = 4; n <= 256; n *= 2) {
    const auto p = cut_where_it_changes(response, 1, n);
    ASSERT_TRUE(p);
    EXPECT_EQ(p->size(), n);
    EXPECT_LT(squared_change(*p, response), before);
    before = squared_change(*p, response);
  }
}

TEST(AdaptiveSky, numbers_out_of_range_and_other_words_are_refused) {
  for (const char* text : {"adaptive", "adaptive:", "adaptive:0", "adaptive:15", "adaptive:8193", "adaptive:64x",
                           "adaptive:-64", "adaptive:99999999999"})
    EXPECT_FALSE(check_regions(text)) << text;
  for (const char* text : {"adaptive:16", "adaptive:8192", "uniform:64", "fine:256"})
    EXPECT_TRUE(check_regions(text)) << text;
}

TEST(AdaptiveSky, error_of_a_small_sun_is_less_than_half_that_of_as_many_equal_regions) {
  const auto room = read_room(DAYLIT_SOURCE_DIR "/tests/fixtures/truth/s1_daylit_cornell.obj");
  ASSERT_TRUE(room) << room.error().message();
  BakeOptions options;
  options.target_facets = 400;
  options.visibility_rays = 4096;
  options.gather_rays = 256;
  options.grid = glm::ivec3(5);
  options.audit = true;
  double sun[2] = {};
  for (const bool adaptive : {false, true}) {
    const auto partition = sky_for(*room, adaptive ? "adaptive:256" : "uniform:256", silent);
    ASSERT_TRUE(partition) << partition.error().message();
    BakeReport report;
    const auto volume = bake_room(*room, *partition, options, silent, report);
    ASSERT_TRUE(volume) << volume.error().message();
    sun[adaptive] = report.audit.sun(&SkyError::sky_part);
    EXPECT_LT(report.audit.smooth(&SkyError::sky_part), 0.02);
    if (!adaptive)
      continue;
    // The file gives the same regions back.
    const auto path = std::filesystem::path(testing::TempDir()) / "adaptive.volume";
    ASSERT_TRUE(write_volume(path, *volume));
    const auto read = read_volume(path);
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_EQ(read->partition.name(), "adaptive:256");
    for (int r = 0; r < partition->size(); ++r) {
      ASSERT_EQ(read->partition.solid_angle_sr(r), partition->solid_angle_sr(r));
      ASSERT_EQ(read->partition.region_of(partition->sample(r, 0.9, 0.1)), r);
    }
  }
  EXPECT_LT(sun[1], 0.5 * sun[0]);
}

} // namespace
} // namespace daylit::precompute
