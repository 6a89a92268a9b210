// Probes without light of their own, in a grid of 5 x 4 x 4.

#include <gtest/gtest.h>

#include "scene/volume/interpolated_probes.h"
#include "scene/volume/volume_combiner.h"
#include "scene/volume/volume_file.h"
#include "tests/scene/test_volumes.h"

namespace daylit {
namespace {

std::size_t at(int x, int y, int z) { return static_cast<std::size_t>(x + 5 * (y + 4 * z)); }

void interpolate(BasisVolume& volume, std::size_t probe, int axis) {
  ProbeSet& probes = volume.probes;
  probes.interpolated.resize(probes.size(), 0);
  probes.interpolated[probe] = static_cast<std::uint8_t>(axis + 1);
  probes.valid[probe] = 0;
}

/// Along x: the second and third plane of one row; along y: one whose neighbour is interpolated along z.
BasisVolume volume_with_gaps() {
  BasisVolume volume = test::graded(test::grid_volume(test::closed_room(), {5, 4, 4}, 7));
  interpolate(volume, at(1, 1, 1), 0);
  interpolate(volume, at(2, 1, 1), 0);
  interpolate(volume, at(0, 2, 1), 2);
  interpolate(volume, at(0, 1, 1), 1);
  return volume;
}

/// The same value a + g x in all coefficients at every valid probe.
LightField linear_field(const ProbeSet& probes, bool everywhere) {
  LightField field{std::vector<Sh9Rgb>(probes.size()), std::vector<Band4Rgb>(probes.size())};
  for (std::size_t i = 0; i < probes.size(); ++i)
    if (everywhere || probes.valid[i]) {
      const Rgb value(0.7f + 0.3f * probes.positions[i].x - 0.2f * probes.positions[i].y +
                      0.5f * probes.positions[i].z);
      field.probe[i].fill(value);
      field.band4[i].fill(2.0f * value);
    }
  return field;
}

TEST(InterpolatedProbes, hold_a_linear_field_exactly_whatever_they_are_interpolated_from) {
  const ProbeSet probes = volume_with_gaps().probes;
  const auto list = interpolated_probes(probes);
  ASSERT_TRUE(list) << list.error().message();
  EXPECT_EQ(list->size(), 4u);
  LightField field = linear_field(probes, false);
  interpolate_probes(*list, field);
  const LightField expected = linear_field(probes, true);
  for (std::size_t i = 0; i < probes.size(); ++i) {
    EXPECT_NEAR(field.probe[i][4].g, expected.probe[i][4].g, 1e-6f) << i;
    EXPECT_NEAR(field.band4[i][8].b, expected.band4[i][8].b, 2e-6f) << i;
  }
}

TEST(InterpolatedProbes, are_filled_in_by_every_way_of_combining) {
  const BasisVolume volume = volume_with_gaps();
  const auto radiance = test::random_radiance(volume, 5);
  const LightField field = combine(volume, radiance);
  const float way = (volume.probes.positions[at(1, 1, 1)].x - volume.probes.positions[at(0, 1, 1)].x) /
                    (volume.probes.positions[at(3, 1, 1)].x - volume.probes.positions[at(0, 1, 1)].x);
  for (std::size_t k = 0; k < 9; ++k)
    EXPECT_NEAR(field.probe[at(1, 1, 1)][k].r,
                std::lerp(field.probe[at(0, 1, 1)][k].r, field.probe[at(3, 1, 1)][k].r, way), 1e-5f);
  VolumeCombiner combiner = VolumeCombiner::make(volume);
  for (const int seed : {1, 2, 5}) { // the last: few regions changed, then all
    auto some = radiance;
    some[static_cast<std::size_t>(seed)] *= 2.0f;
    combiner.update(some);
    const LightField expected = combine(volume, some);
    for (std::size_t i = 0; i < volume.probes.size(); ++i)
      EXPECT_NEAR(combiner.field().probe[i][2].b, expected.probe[i][2].b, 1e-4f) << i;
  }
}

TEST(InterpolatedProbes, let_a_point_between_them_be_interpolated_as_between_valid_ones) {
  const BasisVolume volume = volume_with_gaps();
  const auto sampler = LightFieldSampler::make(volume);
  ASSERT_TRUE(sampler);
  const LightField field = linear_field(volume.probes, true);
  const glm::dvec3 point = volume.probes.origin + glm::dvec3(volume.probes.positions[at(1, 1, 1)]) + glm::dvec3(0.1);
  const auto value = sampler->sample(field, point);
  ASSERT_TRUE(value);
  const glm::vec3 p(point - volume.probes.origin);
  EXPECT_NEAR((*value)[0].r, 0.7f + 0.3f * p.x - 0.2f * p.y + 0.5f * p.z, 1e-5f);
}

TEST(InterpolatedProbes, are_kept_by_the_file) {
  const BasisVolume volume = volume_with_gaps();
  const auto path = std::filesystem::temp_directory_path() / "daylit_interpolated.volume";
  ASSERT_TRUE(write_volume(path, volume));
  const auto read = read_volume(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->probes.interpolated, volume.probes.interpolated);
  EXPECT_EQ(read->probes.valid, volume.probes.valid);
}

TEST(InterpolatedProbes, without_two_neighbours_or_with_light_of_their_own_are_refused) {
  const auto refused = [](const auto& damage) {
    BasisVolume volume = volume_with_gaps();
    damage(volume);
    return !interpolated_probes(volume.probes) && !check_volume(volume);
  };
  EXPECT_FALSE(refused([](BasisVolume&) {}));
  EXPECT_TRUE(refused([](BasisVolume& v) { interpolate(v, at(4, 3, 3), 0); })) << "at the end of its row";
  EXPECT_TRUE(refused([](BasisVolume& v) { v.probes.valid[at(3, 1, 1)] = 0; })) << "beside an invalid one";
  EXPECT_TRUE(refused([](BasisVolume& v) { v.probes.valid[at(1, 1, 1)] = 1; }));
  EXPECT_TRUE(refused([](BasisVolume& v) { v.probes.interpolated[at(1, 1, 1)] = 4; }));
  EXPECT_TRUE(refused([](BasisVolume& v) { v.probes.interpolated.pop_back(); }));
  EXPECT_TRUE(refused([](BasisVolume& v) { interpolate(v, at(0, 1, 2), 0), interpolate(v, at(0, 2, 2), 0); }));
  EXPECT_TRUE(refused([](BasisVolume& v) { interpolate(v, at(1, 2, 1), 2), interpolate(v, at(1, 2, 2), 1); }))
      << "along z from one that only a later axis would know";
}

} // namespace
} // namespace daylit
