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
#include "precompute/detail/node_sharpening.h"
#include "scene/local_combiner.h"
#include "scene/volume_combiner.h"
#include "scene/volume_file.h"
#include "tests/scene/plain_compact.h"

namespace daylit::precompute {
namespace {

const Progress kQuiet = [](const std::string&, double) { return true; };

constexpr int kPieces = 512;

/// Pieces of surface that each receive a wide patch of the sky, in lobes about an axis of their own.
glm::dvec3 axis_of(const SkyPartition& pieces, std::size_t piece) { return pieces.centre(static_cast<int>(piece)); }

/// Irradiance of a piece under a sun of flux 1 from d.
double lit(const glm::dvec3& axis, const glm::dvec3& d) { return std::exp(20.0 * (glm::dot(axis, d) - 1.0)); }

/// Row lm of a point: what it receives from each piece.
double row_weight(const glm::vec3& p, std::size_t lm, const glm::dvec3& axis) {
  const double turn = 0.3 * static_cast<double>(p.x) + 0.2 * static_cast<double>(lm);
  const glm::dvec3 to = glm::normalize(glm::dvec3(std::cos(turn), std::sin(turn), 0.3 + 0.2 * double(p.z)));
  return std::exp(2.0 * (glm::dot(to, axis) - 1.0)) * (1.0 + 0.1 * static_cast<double>(lm));
}

const Rgb kReflectance{0.9f, 0.6f, 0.3f};

struct Case {
  SkyPartition partition = *SkyPartition::fine(2048), pieces = *SkyPartition::uniform(kPieces);
  ProbeSet probes;
  std::vector<std::size_t> probe_of_point;
  SurfaceLight light; ///< each piece is a leaf; all leaves of an element look the same from the points
  std::size_t leaves_of_element = 1;

  /// Of leaf e.
  float weight(std::size_t point, std::size_t lm, std::size_t e) const {
    return static_cast<float>(row_weight(probes.positions[probe_of_point[point]], lm,
                                         axis_of(pieces, e / leaves_of_element * leaves_of_element)) /
                              static_cast<double>(leaves_of_element));
  }
};

/// Only directions with y > -0.5 light anything. Further bounces: every piece passes a hundredth of the light on its
/// cluster, an element, to the next one.
Case make_case(int side, std::size_t leaves_of_element = 1) {
  Case c;
  c.leaves_of_element = leaves_of_element;
  for (int k = 0; k < side * side * side; ++k) {
    c.probes.positions.emplace_back(k % side, k / side % side, k / side / side);
    c.probes.valid.push_back(k % 7 != 3);
    if (k % 7 != 3)
      c.probe_of_point.push_back(static_cast<std::size_t>(k));
  }
  c.light.elements = kPieces / leaves_of_element;
  c.light.leaves = kPieces;
  std::vector<radiosity::FirstBounceRow> rows;
  for (std::size_t e = 0; e < c.light.leaves; ++e) {
    c.light.parent.push_back(static_cast<std::uint32_t>(e / leaves_of_element));
    c.light.leaf_share.push_back(1.0f / static_cast<float>(leaves_of_element));
    radiosity::FirstBounceRow row;
    for (int r = 0; r < c.partition.size(); ++r)
      if (const glm::dvec3 d = c.partition.centre(r); d.y > -0.5 && lit(axis_of(c.pieces, e), d) > 1e-4) {
        row.region.push_back(r);
        row.irradiance.emplace_back(static_cast<float>(lit(axis_of(c.pieces, e), d) * c.partition.solid_angle_sr(r)));
      }
    if (row.region.empty())
      continue;
    c.light.source.push_back(static_cast<std::uint32_t>(e));
    c.light.reflectance.push_back(kReflectance);
    c.light.cluster.push_back(c.light.parent[e]);
    c.light.share.push_back(c.light.leaf_share[e]);
    rows.push_back(std::move(row));
  }
  detail::sharpen_nodes(c.partition, rows);
  c.light.light = std::move(rows);
  c.light.clusters = c.light.elements;
  c.light.bounced.assign(c.light.elements * 3 * c.light.clusters, 0.0f);
  for (std::size_t s = 0; s < c.light.clusters; ++s)
    for (std::size_t channel = 0; channel < 3; ++channel)
      c.light.bounced[((s + 1) % c.light.elements * 3 + channel) * c.light.clusters + s] = 0.01f;
  return c;
}

/// The field of a sun of flux 1 from d, by its definition.
std::vector<Sh9Rgb> exact_field(const Case& c, const glm::dvec3& d) {
  std::vector<glm::dvec3> radiosity(c.light.leaves, glm::dvec3(0.0));
  const std::size_t n = c.leaves_of_element;
  for (std::size_t s = 0; s < c.light.source.size(); ++s) {
    const double e = lit(axis_of(c.pieces, c.light.source[s]), d);
    radiosity[c.light.source[s]] += e * glm::dvec3(kReflectance);
    const std::size_t next = (c.light.source[s] / n + 1) % c.light.elements;
    for (std::size_t leaf = next * n; leaf < (next + 1) * n; ++leaf)
      radiosity[leaf] += e / static_cast<double>(n) * glm::dvec3(0.01);
  }
  std::vector<Sh9Rgb> field(c.probes.size());
  for (std::size_t p = 0; p < c.probe_of_point.size(); ++p)
    for (std::size_t lm = 0; lm < 9; ++lm) {
      glm::dvec3 sum(0.0);
      for (std::size_t e = 0; e < c.light.leaves; ++e)
        sum += double(c.weight(p, lm, e)) * radiosity[e];
      field[c.probe_of_point[p]][lm] = Rgb(sum);
    }
  return field;
}

/// `band4`: not 0: rows of l = 4, as those of the nine in another order and times this.
CompactBasis compress(const Case& c, double error, CompactReport* report = nullptr, bool told_apart = false,
                      float band4 = 0) {
  const auto mark = [&](std::span<const std::uint32_t>, std::span<std::uint8_t> elements) {
    std::ranges::fill(elements, told_apart ? 1 : 0);
  };
  const auto rows = [&](std::span<const std::uint32_t> points, std::span<const std::uint32_t> end, float* out) {
    for (const std::uint32_t point : points)
      for (std::size_t lm = 0; lm < 9; ++lm)
        for (std::size_t k = 0, e = 0; k < end.size(); ++k)
          for (*out++ = 0.0f; e < end[k]; ++e)
            out[-1] += c.weight(point, lm, e);
  };
  GatherRows gather{mark, rows};
  if (band4 != 0)
    gather.band4_rows = [&](std::span<const std::uint32_t> points, std::span<const std::uint32_t> end, float* out) {
      for (const std::uint32_t point : points)
        for (std::size_t m = 0; m < 9; ++m)
          for (std::size_t k = 0, e = 0; k < end.size(); ++k)
            for (*out++ = 0.0f; e < end[k]; ++e)
              out[-1] += band4 * c.weight(point, 8 - m, e);
    };
  auto basis = compact_sky(c.light, gather, c.probes, c.probe_of_point, c.partition,
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
  const std::vector<Sh9Rgb> truth = exact_field(c, d);
  double error = 0, power = 0;
  for (const std::size_t p : c.probe_of_point)
    for (std::size_t row = 0; row < 27; ++row) {
      const double t = static_cast<double>(truth[p][row / 3][static_cast<int>(row % 3)]);
      const double e = static_cast<double>(field[p][row / 3][static_cast<int>(row % 3)]) - t;
      error += e * e;
      power += t * t;
    }
  return std::sqrt(error / power);
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

TEST(CompactSky, band_four_changes_nothing_of_the_nine_and_is_as_exact_as_irradiance_needs) {
  const Case c = make_case(4);
  CompactReport report, plain, faint;
  const CompactBasis nine = compress(c, 0.01, &plain), both = compress(c, 0.01, &report, false, 1.0f),
                     weak = compress(c, 0.01, &faint, false, 1e-3f);
  EXPECT_EQ(both.nine.source_factor, nine.nine.source_factor);
  EXPECT_EQ(both.nine.probe_factor, nine.nine.probe_factor);
  EXPECT_EQ(both.nine.scale, nine.nine.scale);
  EXPECT_TRUE(weak.band4.brick.empty()) << "not worth a byte";
  EXPECT_EQ(faint.bytes, plain.bytes);
  ASSERT_TRUE(check_compact(both, c.partition.size(), c.probes.size()));
  EXPECT_EQ(report.bytes, plain.bytes + report.band4_bytes);
  EXPECT_LT(double(report.band4_components), 0.5 * plain.mean_rank * double(plain.bricks));
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

TEST(CompactSky, elements_seen_as_a_whole_give_the_field_of_their_leaves) {
  const Case c = make_case(4, 4);
  CompactReport as_a_whole, leaf_by_leaf;
  const CompactBasis whole = compress(c, 0.01, &as_a_whole), leaves = compress(c, 0.01, &leaf_by_leaf, true);
  EXPECT_EQ(whole.sources, leaves.sources);
  EXPECT_EQ(whole.group.size(), c.light.elements);
  EXPECT_TRUE(leaves.group.empty());
  EXPECT_LT(3 * whole.nine.source_factor.size(), leaves.nine.source_factor.size());
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
  EXPECT_FALSE(basis.group.empty());
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
  EXPECT_LT(std::sqrt(error / power), 1e-4); // 16 bits of the light on the pieces, and of the amplitudes
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

TEST(CompactSky, same_bits_for_any_thread_count) {
  const Case c = make_case(4);
  const CompactBasis many = compress(c, 0.02, nullptr, false, 1.0f);
  const tbb::global_control single(tbb::global_control::max_allowed_parallelism, 1);
  const CompactBasis one = compress(c, 0.02, nullptr, false, 1.0f);
  for (const CompactFactors CompactBasis::*part : {&CompactBasis::nine, &CompactBasis::band4}) {
    EXPECT_EQ((many.*part).piece, (one.*part).piece);
    EXPECT_EQ((many.*part).source_factor, (one.*part).source_factor);
    EXPECT_EQ((many.*part).probe_factor, (one.*part).probe_factor);
  }
  EXPECT_FALSE(many.band4.brick.empty());
}

BasisVolume volume_of(const Case& c) {
  return {.partition = c.partition,
          .probes = c.probes,
          .stored_region = {},
          .basis = {},
          .compact = std::make_shared<const CompactBasis>(compress(c, 0.02)),
          .room = {},
          .apertures = {},
          .provenance = {}};
}

TEST(CompactSky, probes_of_one_object_have_the_bits_of_the_full_combination) {
  const Case c = make_case(5);
  const BasisVolume volume = volume_of(c);
  VolumeCombiner combiner = VolumeCombiner::make(volume);
  const std::vector<Rgb> radiance = sun(c.partition, glm::normalize(glm::dvec3(0.3, 1, 0.4)));
  EXPECT_EQ(combiner.update(radiance), radiance.size()); // a compact basis is combined as a whole
  EXPECT_EQ(combiner.update(radiance), 0u);
  const std::vector<std::uint32_t> wanted{0, 61, 124, 3};
  const std::vector<Sh9Rgb> some = combiner.combine_at(radiance, wanted);
  for (std::size_t i = 0; i < wanted.size(); ++i)
    EXPECT_EQ(std::memcmp(&some[i], &combiner.field().probe[wanted[i]], sizeof(Sh9Rgb)), 0);
  EXPECT_EQ(some[3], Sh9Rgb{}); // an invalid probe
}

TEST(CompactSky, local_combiner_gives_the_field_of_the_full_combination_at_its_probes) {
  const Case c = make_case(5);
  const BasisVolume volume = volume_of(c);
  const std::vector<std::uint32_t> wanted{0, 1, 5, 6, 61, 62, 66, 3}; // of more than one brick; the last is invalid
  const auto sky = LocalSky::make(volume);
  ASSERT_TRUE(sky);
  const auto local = LocalCombiner::make(*sky, wanted, 0.005);
  ASSERT_TRUE(local);
  EXPECT_LE(local->rank(), 64u);
  double error = 0, power = 0;
  for (int k = 0; k < 40; ++k) {
    const std::vector<Rgb> radiance =
        sun(c.partition, glm::normalize(glm::dvec3(std::cos(0.2 * k), 1.0, std::sin(0.7 * k))));
    std::vector<Sh9Rgb> all(c.probes.size()), some(wanted.size());
    combine(*volume.compact, radiance, all);
    local->combine(radiance, some);
    for (std::size_t i = 0; i < wanted.size(); ++i)
      for (std::size_t l = 0; l < 9; ++l)
        for (int ch = 0; ch < 3; ++ch) {
          const double t = static_cast<double>(all[wanted[i]][l][ch]), d = static_cast<double>(some[i][l][ch]) - t;
          error += d * d;
          power += t * t;
        }
    EXPECT_EQ(some[7], Sh9Rgb{});
  }
  EXPECT_LT(std::sqrt(error / power), 0.006);
  EXPECT_FALSE(LocalCombiner::make(*sky, std::vector<std::uint32_t>{125}));
  EXPECT_FALSE(LocalCombiner::make(*sky, {}));
  EXPECT_FALSE(LocalSky::make(BasisVolume{}));
}

/// The regions that light anything; others than the first `count` light nothing any more.
std::vector<std::size_t> keep_lit(BasisVolume& volume, std::size_t count) {
  std::vector<std::size_t> list;
  const std::vector<std::uint8_t> lit = lit_regions(volume.compact->light, std::size_t(volume.partition.size()));
  for (std::size_t r = 0; r < lit.size(); ++r)
    if (lit[r] != 0)
      list.push_back(r);
  list.resize(std::min(count, list.size()));
  auto basis = std::make_shared<CompactBasis>(*volume.compact);
  for (std::size_t b = 0; b < basis->light.block.size(); ++b)
    for (std::size_t k = 0; k < FirstLight::kBlock; ++k)
      if (FirstLight::kBlock * basis->light.block[b] + k > list.back())
        basis->light.weight[FirstLight::kBlock * b + k] = 0;
  volume.compact = std::move(basis);
  return list;
}

/// Products of the two fields at some probes, and of the second with itself.
std::pair<double, double> common_power(std::span<const Sh9Rgb> some, std::span<const Sh9Rgb> all,
                                       std::span<const std::uint32_t> probes) {
  double common = 0, power = 0;
  for (std::size_t i = 0; i < probes.size(); ++i)
    for (std::size_t k = 0; k < 27; ++k) {
      const double t = double(all[probes[i]][k / 3][int(k % 3)]);
      common += t * double(some[i][k / 3][int(k % 3)]);
      power += t * t;
    }
  return {common, power};
}

TEST(CompactSky, local_combiner_leaves_out_no_region_that_lights_anything) {
  const Case c = make_case(5);
  BasisVolume volume = volume_of(c);
  const std::vector<std::uint32_t> wanted{0, 1, 5, 6, 61, 62, 66};
  for (const std::size_t count : {1100u, 1099u, 1026u, 1025u, 1024u, 513u, 510u}) { // chunks and quads not whole
    const std::vector<std::size_t> regions = keep_lit(volume, count);
    ASSERT_EQ(regions.size(), count);
    const auto sky = LocalSky::make(volume);
    ASSERT_TRUE(sky);
    const auto local = LocalCombiner::make(*sky, wanted, 0.001);
    ASSERT_TRUE(local);
    for (std::size_t r = count - 5; r < count; ++r) {
      std::vector<Rgb> radiance(std::size_t(c.partition.size()), Rgb(0.0f));
      radiance[regions[r]] = Rgb(1.0f, 2.0f, 3.0f);
      std::vector<Sh9Rgb> all(c.probes.size()), some(wanted.size());
      combine(*volume.compact, radiance, all);
      local->combine(radiance, some);
      const auto [common, power] = common_power(some, all, wanted);
      EXPECT_GT(common, 0.5 * power) << r << " of " << count;
    }
  }
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
  EXPECT_EQ(read->compact->group_weight, volume.compact->group_weight);
  EXPECT_EQ(read->compact->nine.piece, volume.compact->nine.piece);
  EXPECT_EQ(read->compact->nine.source_factor, volume.compact->nine.source_factor);
  EXPECT_EQ(read->compact->nine.probe_factor, volume.compact->nine.probe_factor);
  const std::vector<Rgb> radiance = sun(c.partition, {0, 1, 0});
  EXPECT_EQ(combine(*read, radiance).probe, combine(volume, radiance).probe);

  const auto refused = [&](const auto& damage) {
    CompactBasis broken = *volume.compact;
    damage(broken);
    return !check_compact(broken, c.partition.size(), c.probes.size());
  };
  EXPECT_FALSE(refused([](CompactBasis&) {}));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.nine.brick[0].word_rank += 1; }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.nine.brick[0].pieces += 1; }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.nine.probe[1] = b.nine.probe[0]; }));
  EXPECT_TRUE(
      refused([](CompactBasis& b) { b.nine.piece[1] = b.sources + static_cast<std::uint32_t>(b.group.size()); }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.nine.scale[0] = std::numeric_limits<float>::infinity(); }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.group_weight[0] = std::numeric_limits<float>::quiet_NaN(); }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.group = {{0, 2}, {1, 3}}; }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.group = {{0, b.sources + 1}}; }));
  const auto beyond = static_cast<std::uint16_t>(c.partition.size() / 8 + 1);
  EXPECT_TRUE(refused([&](CompactBasis& b) { b.light.block.back() = beyond; }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.light.block[1] = b.light.block[0]; }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.light.weight[0] = 0x7c00; }));
  EXPECT_TRUE(refused([](CompactBasis& b) { b.light.first_block[1] = b.light.first_block.back() + 1; }));
}

} // namespace
} // namespace daylit::precompute
