#include "scene/volume/radiance_matrix.h"

#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "scene/sky/sky_image.h"
#include "tests/scene/parse_matrix.h"
#include "tests/scene/test_volumes.h"

namespace daylit {
namespace {

constexpr double kPi = std::numbers::pi, kDegrees = 180.0 / kPi;

// Radiance's reinhart.cal (G. Ward, 2009) and gendaymtx: alpha = 90 / (MF 7 + .5) degrees between rows, cells
// 30 30 24 24 18 12 6 times MF, azimuth from north (Dy) through east (Dx), bin 0 below the horizon, bin 1 at north.
TEST(ReinhartPatches, are_numbered_and_placed_as_reinhart_cal_says) {
  for (const auto& [k, size] : {std::pair(1, 146), std::pair(2, 578), std::pair(4, 2306)}) {
    const ReinhartPatches patches = *ReinhartPatches::make(k);
    EXPECT_EQ(patches.size(), size);
    const double alpha = 90.0 / (7 * k + 0.5);
    const int row_cells[] = {30, 30, 24, 24, 18, 12, 6};
    int bin = 1;
    for (int row = 0; row < 7 * k; ++row)
      for (int cell = 0; cell < k * row_cells[row / k]; ++cell, ++bin) {
        const glm::dvec3 c = patches.centre(bin);
        ASSERT_NEAR(std::asin(c.z) * kDegrees, alpha * (row + 0.5), 1e-9);
        const double azimuth = std::atan2(c.x, c.y) * kDegrees, expected = 360.0 * cell / (k * row_cells[row / k]);
        ASSERT_NEAR(std::remainder(azimuth - expected, 360.0), 0.0, 1e-9);
        ASSERT_EQ(patches.patch_of(c), bin);
      }
    EXPECT_EQ(patches.patch_of({0, 0, 1}), size - 1);
    EXPECT_EQ(patches.patch_of({0.6, 0, -0.8}), 0);
    double sum = 0.0;
    for (int p = 0; p < size; ++p)
      sum += patches.solid_angle_sr(p);
    EXPECT_NEAR(sum, 4 * kPi, 1e-12);
  }
  EXPECT_FALSE(ReinhartPatches::make(0));
  EXPECT_FALSE(ReinhartPatches::make(13));
}

// 6 degrees north is patch 1; 6 degrees east is half way between two of the 30 cells of that row: 90 / 12 = 7.5.
TEST(ReinhartPatches, first_row_runs_over_east) {
  const ReinhartPatches patches = *ReinhartPatches::make(1);
  const double h = 6.0 / kDegrees;
  EXPECT_EQ(patches.patch_of({0, std::cos(h), std::sin(h)}), 1);
  const double just_north_of_east = 89.0 / kDegrees;
  EXPECT_EQ(patches.patch_of(
                {std::cos(h) * std::sin(just_north_of_east), std::cos(h) * std::cos(just_north_of_east), std::sin(h)}),
            8);
}

TEST(ReinhartPatches, are_regions_of_the_reinhart_partition) {
  for (const int k : {1, 2, 3}) {
    const ReinhartPatches patches = *ReinhartPatches::make(k);
    const SkyPartition partition = k == 1 ? SkyPartition::tregenza() : *SkyPartition::reinhart(k);
    EXPECT_EQ(partition.size(), 2 * (patches.size() - 1));
    for (int p = 1; p < patches.size(); ++p) {
      double most = 0.0, sum = 0.0;
      int region = -1;
      for (const RegionWeight& w : patches.region_radiances(p, partition)) {
        sum += w.weight;
        if (w.weight > most)
          most = w.weight, region = w.region;
      }
      ASSERT_NEAR(most, 1.0, 1e-9) << p;
      ASSERT_NEAR(sum, 1.0, 1e-9) << p;
      ASSERT_EQ(partition.region_of(patches.centre(p)), region);
    }
    for (const RegionWeight& w : patches.region_radiances(0, partition)) {
      EXPECT_NEAR(w.weight, 1.0, 1e-12);
      EXPECT_LT(w.region, partition.size() / 2);
    }
  }
}

// All patches at radiance 1 are the uniform sky: 1 in constant regions, the integral of the hat in nodes.
TEST(ReinhartPatches, together_are_the_uniform_sky_in_every_partition) {
  const ReinhartPatches patches = *ReinhartPatches::make(2);
  for (const char* name : {"uniform:64", "tregenza", "reinhart:3", "fine:256", "fine:1024"}) {
    const SkyPartition partition = *SkyPartition::parse(name);
    std::vector<double> sum(static_cast<std::size_t>(partition.size()), 0.0);
    for (int p = 0; p < patches.size(); ++p)
      for (const RegionWeight& w : patches.region_radiances(p, partition))
        sum[static_cast<std::size_t>(w.region)] += w.weight;
    for (int r = 0; r < partition.size(); ++r) {
      const double expected = partition.interpolated() ? partition.hat_sr(r) / partition.solid_angle_sr(r) : 1.0;
      ASSERT_NEAR(sum[static_cast<std::size_t>(r)], expected, 1e-9) << name << " " << r;
    }
  }
}

// Slow twin: the patch painted into a picture and averaged over the regions.
TEST(ReinhartPatches, region_radiances_are_those_of_a_painted_patch) {
  const ReinhartPatches patches = *ReinhartPatches::make(1);
  for (const int p : {0, 3, 77, 145})
    for (const std::string name : {"uniform:64", "fine:256", "rectangles"}) {
      const SkyPartition partition = name == "rectangles" ? test::rectangles() : *SkyPartition::parse(name);
      RgbImage image(1024, 512);
      for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
          const double theta = kPi * (y + 0.5) / image.height, phi = 2 * kPi * (0.5 - (x + 0.5) / image.width);
          const glm::dvec3 d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
          image.at(x, y) = Rgb(patches.patch_of(d) == p ? 1.0f : 0.0f);
        }
      std::vector<Rgb> painted = region_radiance(*SkyImage::make(image, EquirectProjection{}), partition);
      std::vector<double> weight(painted.size(), 0.0); // a region may come in parts
      for (const RegionWeight& w : patches.region_radiances(p, partition))
        weight[static_cast<std::size_t>(w.region)] += w.weight;
      for (std::size_t r = 0; r < painted.size(); ++r)
        EXPECT_NEAR(static_cast<double>(painted[r].g), weight[r], 0.02) << name << " " << p << " " << r;
    }
}

RadianceMatrix some_matrix() {
  RadianceMatrix m{3, 4, {}};
  for (int i = 0; i < 12; ++i)
    m.value.emplace_back(0.1f * static_cast<float>(i), 1e-12f + static_cast<float>(i),
                         -3.25e7f / static_cast<float>(i + 1));
  return m;
}

TEST(RadianceMatrixFile, every_format_comes_back) {
  const RadianceMatrix m = some_matrix();
  for (const MatrixFormat format : {MatrixFormat::ascii, MatrixFormat::float32, MatrixFormat::float64}) {
    const auto again = test::parse_matrix(matrix_text(m, format, "daylit-probe x"), "test.mtx");
    ASSERT_TRUE(again) << again.error().message();
    EXPECT_EQ(again->rows, 3);
    EXPECT_EQ(again->columns, 4);
    EXPECT_EQ(again->value, m.value) << static_cast<int>(format);
  }
  const std::string text = matrix_text(m, MatrixFormat::ascii, "");
  EXPECT_TRUE(text.starts_with("#?RADIANCE\nNROWS=3\nNCOLS=4\nNCOMP=3\nFORMAT=ascii\n\n")) << text;
}

TEST(RadianceMatrixFile, bad_files_are_refused) {
  const std::string good = matrix_text(some_matrix(), MatrixFormat::ascii, "");
  const std::string binary = matrix_text(some_matrix(), MatrixFormat::float32, "");
  const auto replaced = [](std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  };
  for (const std::string& text :
       {std::string(), std::string("#?RADIANCE\n"), good.substr(0, good.size() / 2), good + "1 ",
        replaced(good, "NROWS=3", "NROWS=4"), replaced(good, "NROWS=3", "NROWS=-3"),
        replaced(good, "NCOMP=3", "NCOMP=1"), replaced(good, "NCOLS=4", "NCOLS=2000000000"),
        replaced(good, "FORMAT=ascii", "FORMAT=32-bit_rle_rgbe"), binary.substr(0, binary.size() - 1), binary + "x",
        replaced(good, "NROWS=3\n", "")})
    EXPECT_FALSE(test::parse_matrix(text, "bad.mtx"));
}

} // namespace
} // namespace daylit
