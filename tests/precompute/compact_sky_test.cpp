// The compact basis against the transport it was made from: a smooth synthetic response of points to directions.

#include <atomic>
#include <cmath>
#include <filesystem>
#include <limits>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "precompute/detail/neighbours.h"
#include "precompute/detail/sun_metric.h"
#include "precompute/detail/surface_transport.h"
#include "scene/volume/volume_file.h"
#include "tests/precompute/compact_case.h"
#include "tests/scene/plain_compact.h"

namespace daylit::precompute {
namespace {

using namespace test_case;

void expect_same_factors(const CompactFactors& a, const CompactFactors& b) {
  EXPECT_EQ(a.probe, b.probe);
  EXPECT_EQ(a.source, b.source);
  const auto expect_same = [](const auto& x, const auto& y) {
    EXPECT_EQ(x.scale, y.scale);
    EXPECT_EQ(x.source_factor, y.source_factor);
    EXPECT_EQ(x.probe_factor, y.probe_factor);
  };
  expect_same(a.strong, b.strong);
  expect_same(a.weak, b.weak);
}

TEST(Neighbours, groups_are_as_few_as_hold_the_points_and_of_one_size) {
  std::vector<glm::vec3> position;
  for (int i = 0; i < 1000; ++i)
    position.emplace_back(0.1f * float(i % 10), 0.2f * float(i / 10 % 10), 0.3f * float(i / 100));
  for (const std::size_t most : {1000u, 999u, 180u, 64u, 7u, 1u}) {
    const auto groups = detail::neighbours(position, {}, most);
    EXPECT_EQ(groups.size(), (position.size() + most - 1) / most);
    std::vector<std::uint32_t> all;
    for (const auto& group : groups) {
      EXPECT_LE(group.size(), most);
      EXPECT_GE(group.size() + 1, position.size() / groups.size());
      all.insert(all.end(), group.begin(), group.end());
    }
    std::ranges::sort(all);
    for (std::uint32_t i = 0; i < position.size(); ++i)
      ASSERT_EQ(all[i], i) << "each point in one group";
  }
}

TEST(CompactSky, sources_too_faint_to_be_squared_spoil_nothing) {
  Case c = make_case(4);
  for (const std::size_t dark : {3u, 200u})
    for (Rgb& x : c.light.light[dark].irradiance)
      x *= dark == 3 ? 0.0f : 1e-30f;
  CompactReport report;
  compress(c, 0.05, &report);
  EXPECT_LT(report.rms_error, 0.05);
}

TEST(CompactSky, sun_between_the_nodes_is_followed_within_the_error) {
  const Case c = make_case(5);
  CompactReport report;
  const CompactBasis basis = compress(c, 0.01, &report);
  ASSERT_TRUE(check_compact(basis, c.partition.size(), c.probes.size()));
  // The lobe's second difference over a node's 4.5 degrees is 20 h^2 = 0.12 of it; plain interpolation would be off by
  // 1/8 of that at worst in either direction.
  for (const double azimuth : {0.5, 1.1, 1.57, 2.0, 2.3})
    for (const double altitude : {0.1, 0.35, 0.6})
      EXPECT_LT(relative_error(c, basis,
                               {std::cos(azimuth) * std::cos(altitude), std::sin(azimuth) * std::cos(altitude),
                                std::sin(altitude)}),
                0.02)
          << azimuth << " " << altitude;
  EXPECT_LT(report.rms_error, 0.0125); // 0.01 for the rank, half of that for the rounding
  EXPECT_GT(report.rms_error, 0.002);
}

TEST(CompactSky, dim_room_beside_a_bright_one_keeps_its_light) {
  Case c = make_case(6);
  c.dim = 1e-3;
  for (const std::size_t p : c.probe_of_point)
    c.part.push_back(c.probes.positions[p].x >= 3.0f ? 1 : 0);
  const CompactBasis basis = compress(c, 0.03);
  for (const double azimuth : {0.5, 1.1, 1.57, 2.3}) {
    const glm::dvec3 d = glm::normalize(glm::dvec3(std::cos(azimuth), std::sin(azimuth), 0.4));
    EXPECT_LT(relative_error(c, basis, d), 0.04) << azimuth;
    EXPECT_LT(relative_error(c, basis, d, true), 0.15)
        << azimuth; // an error counts as one of two fifths of the mean light
  }
}

TEST(CompactSky, room_in_the_dark_beside_a_bright_one_is_kept_without_light) {
  Case c = make_case(6);
  c.dim = 0.0;
  for (const std::size_t p : c.probe_of_point)
    c.part.push_back(c.probes.positions[p].x >= 3.0f ? 1 : 0);
  for (const double error : {0.01, 0.1}) { // a cluster has less and more coefficients than the sketch has columns
    const CompactBasis basis = compress(c, error);
    const auto good = check_compact(basis, c.partition.size(), c.probes.size());
    ASSERT_TRUE(good) << good.error().message();
    EXPECT_LT(relative_error(c, basis, glm::normalize(glm::dvec3(0.5, 1.0, 0.4))), 2 * error) << error;
  }
}

/// Irradiance of the sources under some sky, [source].
std::vector<float> under_a_sky(const SurfaceLight& light) {
  std::vector<float> out;
  for (const radiosity::FirstBounceRow& row : light.light) {
    float sum = 0;
    for (std::size_t k = 0; k < row.region.size(); ++k)
      sum += row.irradiance[k].g * (1.0f + std::sin(0.37f * static_cast<float>(row.region[k])));
    out.push_back(sum);
  }
  return out;
}

TEST(CompactSky, unseen_sources_of_a_cluster_are_joined_and_nothing_that_is_seen_changes) {
  Case c = make_case(3, 4);
  const std::size_t patches_of_cluster = 4;
  for (std::size_t s = 0; s < c.light.source.size(); ++s) {
    c.light.cluster[s] /= static_cast<std::uint32_t>(patches_of_cluster);
    c.light.cluster_fraction[s] /= static_cast<float>(patches_of_cluster);
  }
  std::vector<std::uint8_t> seen(c.light.patches);
  for (std::size_t p = 0; p < seen.size(); ++p)
    seen[p] = p % 3 == 0 ? 1 : 0;
  const SurfaceLight joined = join_unseen(c.light, seen);
  EXPECT_LT(joined.source.size(), 0.6 * static_cast<double>(c.light.source.size()));
  const auto radiosity = [](const SurfaceLight& light) {
    return detail::SurfaceTransport(light).radiosity(1, under_a_sky(light), 1);
  };
  const std::vector<float> before = radiosity(c.light), after = radiosity(joined);
  const float most = *std::ranges::max_element(before);
  for (std::size_t e = 0; e < c.light.elements; ++e)
    if (seen[c.light.parent[e]]) {
      EXPECT_NEAR(after[e], before[e], 1e-6f * most) << e;
    }
}

TEST(CompactSky, panes_of_one_tint_need_one_row_and_those_of_two_need_three) {
  Case c = make_case(3);
  const std::vector<float> unit(c.light.source.size(), 1.0f);
  const auto tinted = [&](const Rgb& even, const Rgb& odd) {
    SurfaceLight light = c.light;
    for (std::size_t s = 0; s < light.light.size(); ++s)
      for (std::size_t k = 0; k < light.light[s].irradiance.size(); ++k)
        light.light[s].irradiance[k] *= k % 2 == 0 ? even : odd;
    return light;
  };
  const Rgb green(0.5f, 0.8f, 0.6f), red(0.8f, 0.3f, 0.2f);
  EXPECT_EQ(detail::store_first_light(c.light, unit).colours, 1u);
  for (const bool one : {true, false}) {
    const SurfaceLight light = tinted(green, one ? green : red);
    const FirstLight stored = detail::store_first_light(light, unit);
    EXPECT_EQ(stored.colours, 3u);
    EXPECT_EQ(stored.rows(), (one ? 1 : 3) * light.source.size());
    const std::vector<Rgb> sky(static_cast<std::size_t>(c.partition.size()), Rgb(1.0f, 2.0f, 3.0f)),
        got = irradiance_of_sources(stored, sky);
    for (std::size_t s = 0; s < light.source.size(); ++s) {
      Rgb expected(0.0f);
      for (const Rgb& x : light.light[s].irradiance)
        expected += x * Rgb(1.0f, 2.0f, 3.0f);
      for (int channel = 0; channel < 3; ++channel)
        EXPECT_NEAR(got[s][channel], expected[channel], 4e-3f * expected[channel])
            << s << ": weights have 8 bits of significand";
    }
  }
}

TEST(CompactSky, band_four_changes_nothing_of_the_nine_and_is_as_exact_as_irradiance_needs) {
  const Case c = make_case(4);
  CompactReport report, plain, faint;
  const CompactBasis nine = compress(c, 0.01, &plain), both = compress(c, 0.01, &report, false, 1.0f),
                     weak = compress(c, 0.01, &faint, false, 1e-3f);
  expect_same_factors(both.nine, nine.nine);
  EXPECT_TRUE(weak.band4.cluster.empty()) << "not worth a byte";
  EXPECT_EQ(faint.bytes, plain.bytes);
  ASSERT_TRUE(check_compact(both, c.partition.size(), c.probes.size()));
  EXPECT_EQ(report.bytes, plain.bytes + report.band4_bytes);
  EXPECT_LT(double(report.band4_components), 0.5 * plain.mean_rank * double(plain.probe_clusters));
  double error = 0, power = 0;
  for (const double azimuth : {0.5, 1.1, 1.57, 2.0, 2.3}) {
    const glm::dvec3 d(std::cos(azimuth) * 0.9, std::sin(azimuth) * 0.9, std::sqrt(1 - 0.81));
    std::vector<Sh9Rgb> field(c.probes.size());
    std::vector<Band4Rgb> band4(c.probes.size());
    combine(both, sun(c.partition, d), field, band4);
    const std::vector<Sh9Rgb> truth = exact_field(c, d);
    for (const std::size_t p : c.probe_of_point)
      for (std::size_t m = 0; m < 9; ++m) {
        const glm::dvec3 t(truth[p][8 - m]), e = glm::dvec3(band4[p][m]) - t;
        error += glm::dot(e, e);
        power += glm::dot(t, t);
      }
  }
  // An error of 0.01 in the nine is worth 0.01 / 0.06 here.
  EXPECT_LT(std::sqrt(error / power), 0.17);
  EXPECT_GT(std::sqrt(error / power), 0.01);
}

TEST(CompactSky, patches_seen_as_a_whole_give_the_field_of_their_leaves) {
  const Case c = make_case(4, 4);
  CompactReport as_a_whole, leaf_by_leaf;
  const CompactBasis whole = compress(c, 0.01, &as_a_whole), leaves = compress(c, 0.01, &leaf_by_leaf, true);
  EXPECT_EQ(whole.sources(), leaves.sources());
  EXPECT_EQ(whole.aggregate.size(), c.light.patches);
  EXPECT_TRUE(leaves.aggregate.empty());
  EXPECT_LT(3 * whole.nine.weak.source_factor.size(), leaves.nine.weak.source_factor.size());
  for (const double azimuth : {0.5, 1.1, 1.57, 2.3}) {
    const glm::dvec3 d(std::cos(azimuth) * 0.9, std::sin(azimuth) * 0.9, std::sqrt(1 - 0.81));
    EXPECT_LT(relative_error(c, whole, d), 0.025) << azimuth;
    EXPECT_LT(relative_error(c, leaves, d), 0.025) << azimuth;
  }
  EXPECT_LT(as_a_whole.rms_error, 0.0125);
  EXPECT_NEAR(as_a_whole.mean_rank, leaf_by_leaf.mean_rank, 0.1 * leaf_by_leaf.mean_rank);
}

TEST(CompactSky, fast_sums_give_what_the_factors_define) {
  const Case c = make_case(4, 4);
  const CompactBasis basis = compress(c, 0.005);
  EXPECT_FALSE(basis.aggregate.empty());
  std::vector<Rgb> radiance(static_cast<std::size_t>(c.partition.size()));
  for (std::size_t r = 0; r < radiance.size(); ++r)
    radiance[r] = Rgb(1.0f + float(r % 7), 0.5f * float(r % 3), 0.1f);
  std::vector<Sh9Rgb> field(c.probes.size());
  combine(basis, radiance, field);
  const auto plain = test::plain_field(basis, basis.nine, radiance, c.probes.size());
  double error = 0, power = 0;
  for (std::size_t p = 0; p < plain.size(); ++p)
    for (std::size_t l = 0; l < 9; ++l) {
      const glm::dvec3 d = glm::dvec3(field[p][l]) - glm::dvec3(plain[p][l]), t(plain[p][l]);
      error += glm::dot(d, d);
      power += glm::dot(t, t);
    }
  EXPECT_LT(std::sqrt(error / power), 2e-6); // sums of floats
  EXPECT_GT(power, 0.0);
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

TEST(CompactSky, ends_at_whatever_step_it_is_told_to) {
  const Case c = make_case(4);
  std::atomic<int> all = 0;
  ASSERT_TRUE(try_compress(c, 0.05, [&](const std::string&, double) { return ++all > 0; }));
  ASSERT_GE(all, 4);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1); // clusters after it have no rows
  for (int last = 1; last <= all; ++last) {
    std::atomic<int> calls = 0;
    const auto stopped = try_compress(c, 0.05, [&](const std::string&, double) { return ++calls < last; });
    ASSERT_FALSE(stopped) << last;
    EXPECT_EQ(stopped.error().code, ErrorCode::interrupted);
  }
}

TEST(CompactSky, same_bits_for_any_thread_count) {
  const Case c = make_case(4);
  const CompactBasis many = compress(c, 0.02, nullptr, false, 1.0f);
  const tbb::global_control single(tbb::global_control::max_allowed_parallelism, 1);
  const CompactBasis one = compress(c, 0.02, nullptr, false, 1.0f);
  expect_same_factors(many.nine, one.nine);
  expect_same_factors(many.band4, one.band4);
  EXPECT_FALSE(many.band4.cluster.empty());
}

TEST(CompactSky, file_keeps_every_bit_and_is_refused_when_a_size_is_wrong) {
  const Case c = make_case(3);
  const BasisVolume volume = volume_of(c);
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "compact.volume";
  const auto written = write_volume(path, volume);
  ASSERT_TRUE(written) << written.error().message();
  const auto read = read_volume(path);
  ASSERT_TRUE(read) << read.error().message();
  ASSERT_TRUE(read->compact);
  EXPECT_TRUE(read->partition.interpolated());
  EXPECT_EQ(read->compact->light.weight, volume.compact->light.weight);
  EXPECT_EQ(read->compact->aggregate_weight, volume.compact->aggregate_weight);
  expect_same_factors(read->compact->nine, volume.compact->nine);
  const std::vector<Rgb> radiance = sun(c.partition, {0, 1, 0});
  EXPECT_EQ(combine(*read, radiance).probe, combine(volume, radiance).probe);

  const auto refused = [&](const auto& damage) {
    CompactBasis broken = *volume.compact;
    damage(broken);
    return !check_compact(broken, c.partition.size(), c.probes.size());
  };
  EXPECT_FALSE(refused([](CompactBasis&) {}));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.nine.cluster[0].strong += 1; }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.nine.cluster[0].sources += 1; }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.nine.weak.probe_factor.pop_back(); }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.nine.probe[1] = b.nine.probe[0]; }));
  EXPECT_TRUE(refused(
      [](CompactBasis& b) { b.nine.source[1] = static_cast<std::uint32_t>(b.sources() + b.aggregate.size()); }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.nine.weak.scale[0] = std::numeric_limits<float>::infinity(); }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.aggregate_weight[0] = std::numeric_limits<float>::quiet_NaN(); }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.aggregate = {{0, 2}, {1, 3}}; }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.aggregate = {{0, static_cast<std::uint32_t>(b.sources() + 1)}}; }));
  const auto beyond = static_cast<std::uint16_t>(c.partition.size() / 8 + 1);
  EXPECT_TRUE(refused([&](CompactBasis& b) { b.light.block.back() = beyond; }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.light.block[1] = b.light.block[0]; }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.light.weight[0] = 0x7c00; }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.light.first_block[1] = b.light.first_block.back() + 1; }));
}

} // namespace
} // namespace daylit::precompute
