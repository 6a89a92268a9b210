// The compact basis against the transport it was made from: a smooth synthetic response of points to directions.

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "precompute/compact_sky.h"
#include "scene/volume_combiner.h"
#include "scene/volume_file.h"

namespace daylit::precompute {
namespace {

const Progress kQuiet = [](const std::string&, double) { return true; };

/// Response of coefficient `row` at a point to a direction, per steradian: lobes whose axis turns with the point.
double response(const glm::vec3& p, std::size_t row, const glm::dvec3& d) {
  const double turn = 0.3 * static_cast<double>(p.x) + 0.2 * static_cast<double>(row % 27);
  const glm::dvec3 axis = glm::normalize(glm::dvec3(std::cos(turn), std::sin(turn), 0.3 + 0.2 * double(p.z)));
  return std::exp(6.0 * (glm::dot(axis, d) - 1.0)) * (1.0 + 0.1 * static_cast<double>(row / 3));
}

struct Case {
  SkyPartition partition = *SkyPartition::fine(512);
  ProbeSet probes;
  std::vector<std::size_t> probe_of_point;
  std::vector<std::int32_t> stored;
  std::vector<float> coefficients; ///< [point][27][region]
};

/// Means over regions by 8 x 8 points; only directions with y > -0.5 light anything.
Case make_case(int side) {
  Case c;
  for (int k = 0; k < side * side * side; ++k) {
    c.probes.positions.emplace_back(k % side, k / side % side, k / side / side);
    c.probes.valid.push_back(k % 7 != 3);
    if (k % 7 != 3)
      c.probe_of_point.push_back(static_cast<std::size_t>(k));
  }
  for (int r = 0; r < c.partition.size(); ++r)
    if (c.partition.centre(r).y > -0.5)
      c.stored.push_back(r);
  c.coefficients.resize(c.probe_of_point.size() * 27 * c.stored.size());
  for (std::size_t k = 0; k < c.stored.size(); ++k)
    for (int s = 0; s < 16; ++s) {
      const glm::dvec3 d = c.partition.sample(c.stored[k], (s % 4 + 0.5) / 4, (s / 4 + 0.5) / 4);
      for (std::size_t p = 0; p < c.probe_of_point.size(); ++p)
        for (std::size_t row = 0; row < 27; ++row)
          c.coefficients[(p * 27 + row) * c.stored.size() + k] += static_cast<float>(
              response(c.probes.positions[c.probe_of_point[p]], row, d) * c.partition.solid_angle_sr(c.stored[k]) / 16);
    }
  return c;
}

CompactBasis compress(const Case& c, double error, CompactReport* report = nullptr) {
  auto basis = compact_sky(c.coefficients, c.probes, c.probe_of_point, c.partition, c.stored,
                           {.error = error, .brick_probes = 40}, kQuiet, report);
  EXPECT_TRUE(basis) << basis.error().message();
  return *basis;
}

/// A sun of flux 1 from a direction, on the nodes.
std::vector<Rgb> sun(const SkyPartition& partition, const glm::dvec3& d) {
  std::vector<Rgb> radiance(static_cast<std::size_t>(partition.size()), Rgb(0.0f));
  for (const RegionWeight& w : partition.interpolation(d))
    radiance[static_cast<std::size_t>(w.region)] +=
        Rgb(static_cast<float>(w.weight / partition.solid_angle_sr(w.region)));
  return radiance;
}

double relative_error(const Case& c, const CompactBasis& basis, const glm::dvec3& d) {
  std::vector<Sh9Rgb> field(c.probes.size());
  combine(basis, sun(c.partition, d), field);
  double error = 0, power = 0;
  for (const std::size_t p : c.probe_of_point)
    for (std::size_t row = 0; row < 27; ++row) {
      const double t = response(c.probes.positions[p], row, d);
      const double e = static_cast<double>(field[p][row / 3][static_cast<int>(row % 3)]) - t;
      error += e * e;
      power += t * t;
    }
  return std::sqrt(error / power);
}

TEST(CompactSky, sun_between_the_nodes_is_followed_within_the_error) {
  const Case c = make_case(5);
  CompactReport report;
  const CompactBasis basis = compress(c, 0.01, &report);
  ASSERT_TRUE(check_compact(basis, c.partition.size(), c.probes.size()));
  // The lobe's second difference over a region 9 degrees wide is 6 h^2 = 0.15 of it: constant regions would be off by
  // about sqrt(1/12) h times its slope, 16 %, plain interpolation by 1/8 of 0.15.
  for (const double azimuth : {0.5, 1.1, 1.57, 2.0, 2.3})
    for (const double altitude : {0.1, 0.35, 0.6})
      EXPECT_LT(relative_error(c, basis,
                               {std::cos(azimuth) * std::cos(altitude), std::sin(azimuth) * std::cos(altitude),
                                std::sin(altitude)}),
                0.025)
          << azimuth << " " << altitude;
  EXPECT_LT(report.rms_error, 0.0125); // 0.01 for the rank, half of that for the rounding
  EXPECT_GT(report.rms_error, 0.002);
}

TEST(CompactSky, smaller_errors_cost_more_numbers) {
  const Case c = make_case(4);
  CompactReport fine, coarse;
  compress(c, 0.003, &fine);
  compress(c, 0.1, &coarse);
  EXPECT_LT(fine.rms_error, 0.004);
  EXPECT_LT(coarse.rms_error, 0.13);
  EXPECT_GT(fine.bytes, coarse.bytes);
}

TEST(CompactSky, same_bits_for_any_thread_count) {
  const Case c = make_case(4);
  const CompactBasis many = compress(c, 0.02);
  const tbb::global_control single(tbb::global_control::max_allowed_parallelism, 1);
  const CompactBasis one = compress(c, 0.02);
  EXPECT_EQ(many.node_half, one.node_half);
  EXPECT_EQ(many.node_byte, one.node_byte);
  EXPECT_EQ(many.probe_half, one.probe_half);
  EXPECT_EQ(many.probe_byte, one.probe_byte);
}

TEST(CompactSky, probes_of_one_object_have_the_bits_of_the_full_combination) {
  const Case c = make_case(5);
  BasisVolume volume{.partition = c.partition,
                     .probes = c.probes,
                     .stored_region = {},
                     .basis = {},
                     .compact = std::make_shared<const CompactBasis>(compress(c, 0.02)),
                     .room = {},
                     .apertures = {},
                     .provenance = {}};
  VolumeCombiner combiner = VolumeCombiner::make(volume);
  const std::vector<Rgb> radiance = sun(c.partition, glm::normalize(glm::dvec3(0.3, 1, 0.4)));
  EXPECT_EQ(combiner.update(radiance), 4u);
  EXPECT_EQ(combiner.update(radiance), 0u);
  const std::vector<std::uint32_t> wanted{0, 61, 124, 3};
  const std::vector<Sh9Rgb> some = combiner.combine_at(radiance, wanted);
  for (std::size_t i = 0; i < wanted.size(); ++i)
    EXPECT_EQ(std::memcmp(&some[i], &combiner.field().probe[wanted[i]], sizeof(Sh9Rgb)), 0);
  EXPECT_EQ(some[3], Sh9Rgb{}); // an invalid probe
}

TEST(CompactSky, file_keeps_every_bit_and_is_refused_when_a_size_is_wrong) {
  const Case c = make_case(3);
  BasisVolume volume{.partition = c.partition,
                     .probes = c.probes,
                     .stored_region = {},
                     .basis = {},
                     .compact = std::make_shared<const CompactBasis>(compress(c, 0.02)),
                     .room = {},
                     .apertures = {},
                     .provenance = {}};
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "compact.volume";
  const auto written = write_volume(path, volume);
  ASSERT_TRUE(written) << written.error().message();
  const auto read = read_volume(path);
  ASSERT_TRUE(read) << read.error().message();
  ASSERT_TRUE(read->compact);
  EXPECT_TRUE(read->partition.interpolated());
  EXPECT_EQ(read->compact->node_scale, volume.compact->node_scale);
  EXPECT_EQ(read->compact->node_byte, volume.compact->node_byte);
  EXPECT_EQ(read->compact->probe_half, volume.compact->probe_half);
  const std::vector<Rgb> radiance = sun(c.partition, {0, 1, 0});
  EXPECT_EQ(combine(*read, radiance).probe, combine(volume, radiance).probe);

  CompactBasis broken = *volume.compact;
  broken.brick[0].half_rank += 1;
  EXPECT_FALSE(check_compact(broken, c.partition.size(), c.probes.size()));
  broken = *volume.compact;
  broken.probe[1] = broken.probe[0];
  EXPECT_FALSE(check_compact(broken, c.partition.size(), c.probes.size()));
  broken = *volume.compact;
  broken.node.back() = c.partition.size();
  EXPECT_FALSE(check_compact(broken, c.partition.size(), c.probes.size()));
  broken = *volume.compact;
  broken.byte_scale[0] = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(check_compact(broken, c.partition.size(), c.probes.size()));
}

} // namespace
} // namespace daylit::precompute
