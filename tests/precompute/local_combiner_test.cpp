// The light at a few probes of a compact basis, alone and as a part of all.

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "scene/volume/local_combiner.h"
#include "scene/volume/volume_combiner.h"
#include "tests/precompute/compact_case.h"

namespace daylit::precompute {
namespace {

using namespace test_case;

TEST(LocalCombiner, probes_of_one_object_have_the_bits_of_the_full_combination) {
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

TEST(LocalCombiner, gives_the_field_of_the_full_combination_at_its_probes) {
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

TEST(LocalCombiner, leaves_out_no_region_that_lights_anything) {
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

} // namespace
} // namespace daylit::precompute
