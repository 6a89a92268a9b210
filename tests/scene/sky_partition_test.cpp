#include "scene/sky/sky_partition.h"

#include <cmath>
#include <numbers>
#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "tests/scene/test_volumes.h"

namespace daylit {
namespace {

constexpr double kPi = std::numbers::pi;

std::vector<SkyPartition> partitions() {
  std::vector<SkyPartition> out;
  for (const char* text : {"uniform:2", "uniform:4", "uniform:6", "uniform:8", "uniform:64", "uniform:1024",
                           "uniform:5000", "tregenza", "reinhart:1", "reinhart:2", "reinhart:4", "reinhart:12"})
    out.push_back(*SkyPartition::parse(text));
  out.push_back(test::rectangles());
  return out;
}

TEST(SkyPartition, solid_angles_sum_to_four_pi) {
  for (const SkyPartition& p : partitions()) {
    double sum = 0;
    for (int r = 0; r < p.size(); ++r)
      sum += p.solid_angle_sr(r);
    EXPECT_NEAR(sum, 4 * kPi, 1e-9) << p.name();
  }
}

TEST(SkyPartition, uniform_regions_are_equal) {
  for (int n : {2, 6, 64, 256, 1024, 99998}) {
    const SkyPartition p = *SkyPartition::uniform(n);
    ASSERT_EQ(p.size(), n);
    for (int r = 0; r < n; ++r)
      ASSERT_NEAR(p.solid_angle_sr(r) * n / (4 * kPi), 1.0, 1e-9) << n << " region " << r;
  }
}

TEST(SkyPartition, region_of_a_sample_is_the_region) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const SkyPartition& p : partitions())
    for (int r = 0; r < p.size(); ++r) {
      ASSERT_EQ(p.region_of(p.sample(r, unit(random), unit(random))), r) << p.name();
      ASSERT_EQ(p.region_of(p.sample(r, 0.0, 0.0)), r) << p.name();
      ASSERT_EQ(p.region_of(p.sample(r, 1.0, 1.0)), r) << p.name();
    }
}

TEST(SkyPartition, centre_is_the_mean_direction) {
  for (const SkyPartition& p :
       {*SkyPartition::uniform(64), SkyPartition::tregenza(), *SkyPartition::reinhart(2), test::rectangles()}) {
    for (int r = 0; r < p.size(); ++r) {
      glm::dvec3 sum{0.0};
      for (int i = 0; i < 64; ++i)
        for (int j = 0; j < 64; ++j)
          sum += p.sample(r, (i + 0.5) / 64, (j + 0.5) / 64);
      ASSERT_GT(glm::dot(glm::normalize(sum), p.centre(r)), 1 - 1e-6) << p.name() << " region " << r;
    }
  }
}

TEST(SkyPartition, every_direction_has_a_region_whose_share_is_its_solid_angle) {
  const SkyPartition p = *SkyPartition::uniform(64);
  std::vector<int> hits(64);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  constexpr int kDirections = 640000;
  for (int i = 0; i < kDirections; ++i)
    ++hits[static_cast<std::size_t>(
        p.region_of(glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)))))];
  for (int h : hits)
    EXPECT_NEAR(h, 10000, 600); // six standard deviations
}

TEST(SkyPartition, no_region_crosses_the_horizon) {
  for (const SkyPartition& p : partitions())
    for (const SkyBand& band : p.bands())
      EXPECT_TRUE(band.sin_high <= 0 || band.sin_low >= 0) << p.name();
}

TEST(SkyPartition, lower_half_mirrors_the_upper_half) {
  for (const SkyPartition& p : partitions()) {
    const auto& bands = p.bands();
    for (std::size_t i = 0; i < bands.size() && p.rectangles().empty(); ++i) {
      const SkyBand& mirror = bands[bands.size() - 1 - i];
      EXPECT_EQ(bands[i].sin_low, -mirror.sin_high);
      EXPECT_EQ(bands[i].cells, mirror.cells);
    }
  }
}

TEST(SkyPartition, tregenza_has_the_published_bands) {
  const SkyPartition p = SkyPartition::tregenza();
  ASSERT_EQ(p.size(), 290);
  const int cells[] = {30, 30, 24, 24, 18, 12, 6, 1};
  int above = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    const SkyBand& band = p.bands()[8 + i];
    EXPECT_EQ(band.cells, cells[i]);
    EXPECT_NEAR(std::asin(band.sin_low) * 180 / kPi, 12.0 * static_cast<double>(i), 1e-9);
    above += band.cells;
  }
  EXPECT_EQ(above, 145);
  // Every band has a patch centred on +y, north.
  for (const SkyBand& band : p.bands())
    if (band.cells > 1) {
      const double middle = 0.5 * (std::asin(band.sin_low) + std::asin(band.sin_high));
      const glm::dvec3 centre = p.centre(p.region_of({0, std::cos(middle), std::sin(middle)}));
      EXPECT_NEAR(centre.x, 0.0, 1e-12);
    }
}

TEST(SkyPartition, reinhart_2_has_577_patches_above_the_horizon) {
  const SkyPartition p = *SkyPartition::reinhart(2);
  EXPECT_EQ(p.size(), 2 * 577);
  EXPECT_EQ(p.bands().back().cells, 1);
  EXPECT_EQ(SkyPartition::reinhart(1)->size(), 290);
  EXPECT_EQ(SkyPartition::reinhart(4)->size(), 2 * (144 * 16 + 1));
}

TEST(SkyPartition, bad_requests_are_errors) {
  for (const char* text :
       {"", "uniform", "uniform:", "uniform:7", "uniform:0", "uniform:-2", "uniform:100002", "uniform:64x",
        "reinhart:0", "reinhart:13", "tregenza:2", "klems", "uniform:99999999999999999999"})
    EXPECT_FALSE(SkyPartition::parse(text)) << text;
  EXPECT_FALSE(SkyPartition::from_bands({{-1, 1, 4, 0, false}}, "no horizon"));
  EXPECT_FALSE(SkyPartition::from_bands({{-1, 0, 2, 0, false}, {0.1, 1, 2, 2, false}}, "gap"));
  EXPECT_FALSE(SkyPartition::from_bands({{-1, 0, 2, 0, false}, {0, 1, 2, 3, false}}, "numbering"));
  EXPECT_FALSE(SkyPartition::from_bands({}, "empty"));
}

TEST(SkyPartition, rectangles_that_overlap_leave_gaps_or_cross_the_horizon_are_errors) {
  const std::vector<SkyBand> bands{{-1, 0, 4, 0, false}, {0, 1, 4, 4, false}};
  const auto made = [&](std::vector<SkyRectangle> r) {
    return SkyPartition::from_rectangles(bands, std::move(r), "t");
  };
  EXPECT_TRUE(made({{0, 0, 1, 4}, {1, 0, 1, 4}}));
  EXPECT_FALSE(made({{0, 0, 2, 4}}));                                 // across the horizon
  EXPECT_FALSE(made({{0, 0, 1, 4}, {1, 0, 1, 3}}));                   // gap
  EXPECT_FALSE(made({{0, 0, 1, 4}, {1, 0, 1, 4}, {1, 1, 1, 1}}));     // overlap
  EXPECT_FALSE(made({{0, 0, 1, 4}, {1, 0, 1, 5}}));                   // out of the cells
  EXPECT_FALSE(made({{0, 0, 1, 4}, {1, 2147483647, 1, 2147483647}})); // the same, in overflow
  EXPECT_FALSE(made({{0, 0, 1, 4}, {1, 0, 1, 4}, {-1, 0, 1, 4}}));
  EXPECT_FALSE(made({{0, 0, 1, 4}, {1, 0, 1, 4}, {1, 0, 0, 0}}));
  EXPECT_FALSE(made({}));
  const std::vector<SkyBand> many{{-1, 0, 16384, 0, false}, {0, 1, 16384, 16384, false}};
  EXPECT_FALSE(SkyPartition::from_rectangles(many, {{0, 0, 1, 16384}, {1, 0, 1, 16384}}, "many"));
  const std::vector<SkyBand> uneven{{-1, 0, 4, 0, false}, {0, 1, 2, 4, false}};
  EXPECT_FALSE(SkyPartition::from_rectangles(uneven, {{0, 0, 1, 4}, {1, 0, 1, 2}}, "uneven"));
}

TEST(SkyPartition, from_bands_restores_a_partition) {
  const SkyPartition p = *SkyPartition::uniform(64);
  const SkyPartition q = *SkyPartition::from_bands(p.bands(), p.name());
  for (int r = 0; r < p.size(); ++r)
    EXPECT_EQ(q.region_of(p.centre(r)), r);
}

TEST(SkyPartition, hats_sum_to_one_and_their_integrals_to_four_pi) {
  for (const int nodes : {16, 512, 4096}) {
    const SkyPartition p = *SkyPartition::fine(nodes);
    ASSERT_TRUE(p.interpolated());
    double total = 0;
    for (int r = 0; r < p.size(); ++r)
      total += p.hat_sr(r);
    EXPECT_NEAR(total, 4 * std::numbers::pi, 1e-9);
    // Monte Carlo over the regions: integral of one hat against its closed form, and weights that sum to 1.
    const int node = p.size() / 3;
    double integral = 0;
    for (int r = 0; r < p.size(); ++r)
      for (int k = 0; k < 256; ++k) {
        double sum = 0;
        for (const RegionWeight& w : p.interpolation(p.sample(r, (k % 16 + 0.5) / 16, (k / 16 + 0.5) / 16))) {
          ASSERT_GE(w.weight, 0.0);
          sum += w.weight;
          integral += w.region == node ? w.weight * p.solid_angle_sr(r) / 256 : 0.0;
        }
        ASSERT_NEAR(sum, 1.0, 1e-12);
      }
    EXPECT_NEAR(integral / p.hat_sr(node), 1.0, 0.01) << nodes;
  }
}

TEST(SkyPartition, hat_is_one_at_its_own_centre) {
  const SkyPartition p = *SkyPartition::fine(256);
  for (int r = 0; r < p.size(); ++r) {
    double own = 0;
    for (const RegionWeight& w : p.interpolation(p.centre(r)))
      own += w.region == r ? w.weight : 0.0;
    EXPECT_NEAR(own, 1.0, 1e-9) << r;
  }
}

TEST(SkyPartition, hats_of_nodes_behind_a_vertical_plane_along_an_axis_end_at_the_plane) {
  for (const int nodes : {16, 300, 16384}) {
    const SkyPartition p = *SkyPartition::fine(nodes);
    EXPECT_NEAR(p.size(), nodes, nodes < 100 ? 16 : 0.1 * nodes);
    for (int axis = 0; axis < 2; ++axis)
      for (int k = 1; k < 500; ++k) {
        const double z = -1.0 + k / 250.0, turn = k * 0.61803398875;
        glm::dvec3 d(std::cos(6.2831853 * turn) * std::sqrt(1 - z * z),
                     std::sin(6.2831853 * turn) * std::sqrt(1 - z * z), z);
        for (const RegionWeight& w : p.interpolation(d))
          if (w.weight > 1e-9) {
            EXPECT_GT(p.centre(w.region)[axis] * d[axis], -1e-9) << nodes << " " << k;
          }
      }
  }
}

} // namespace
} // namespace daylit
