// Light stays on its side of a wall that is thinner than the probes are apart.

#include <algorithm>

#include <gtest/gtest.h>

#include "precompute/bake.h"
#include "tests/scene/test_rooms.h"

namespace daylit::precompute {
namespace {

/// Two rooms side by side with 1 cm of wall between them, 2 m and `second_m` wide: one looks out towards -y, the other
/// towards +y.
RoomFile two_rooms(double second_m) {
  const double end = 2.01 + second_m;
  test::RoomBuilder b;
  const std::uint32_t white = b.material("white", Rgb(0.8f)), pane = b.material("window");
  b.box({0, 0, 0}, {2, 2, 2}, white, 63 & ~4u);
  b.quad({0, 0, 0}, {2, 0, 0}, {2, 0, 2}, {0, 0, 2}, pane);
  b.box({2.01, 0, 0}, {end, 2, 2}, white, 63 & ~8u);
  b.quad({2.01, 2, 0}, {end, 2, 0}, {end, 2, 2}, {2.01, 2, 2}, pane);
  RoomFile file;
  file.room = std::move(b.room);
  return file;
}

/// Radiance 1 in the regions that lie wholly on the side y < 0.
std::vector<Rgb> sky_towards_minus_y(const SkyPartition& partition) {
  std::vector<Rgb> radiance(static_cast<std::size_t>(partition.size()), Rgb(0.0f));
  for (int r = 0; r < partition.size(); ++r) {
    double most = -1;
    for (int k = 0; k < 81; ++k)
      most = std::max(most, partition.sample(r, k % 9 / 8.0, k / 9 / 8.0).y);
    radiance[static_cast<std::size_t>(r)] = Rgb(most < 1e-6 ? 1.0f : 0.0f);
  }
  return radiance;
}

/// The same on nodes: those whose hats, and those of the neighbours that sharpening takes from, end before y = 0.
std::vector<Rgb> nodes_towards_minus_y(const SkyPartition& nodes) {
  std::vector<Rgb> radiance(static_cast<std::size_t>(nodes.size()), Rgb(0.0f));
  for (int r = 0; r < nodes.size(); ++r)
    radiance[static_cast<std::size_t>(r)] = Rgb(nodes.centre(r).y < -0.6 ? 1.0f : 0.0f);
  return radiance;
}

void expect_dark_behind_the_wall(const SkyPartition& partition, const std::vector<Rgb>& radiance, double second_m) {
  BakeOptions options;
  options.target_facets = 300;
  options.gather_rays = 512;
  options.spacing_m = 0.3;
  BakeReport report;
  const auto volume = bake(
      two_rooms(second_m), partition, options, [](const std::string&, double) { return true; }, report);
  ASSERT_TRUE(volume) << volume.error().message();
  const auto sampler = LightFieldSampler::make(*volume);
  ASSERT_TRUE(sampler);
  const LightField field = combine(*volume, radiance);
  float dark = 0, lit = 1e9f;
  int dark_points = 0;
  for (const double from_wall : {0.001, 0.01, 0.05, 0.12, 0.2, 0.3, 0.5})
    for (double y = 0.1; y < 2; y += 0.3)
      for (double z = 0.1; z < 2; z += 0.3) {
        const auto here = sampler->sample(field, {2.0 - from_wall, y, z});
        ASSERT_TRUE(here) << from_wall << " " << y << " " << z;
        lit = std::min(lit, (*here)[0].g);
        const auto there = sampler->sample(field, {2.01 + from_wall, y, z});
        ASSERT_TRUE(there);
        ++dark_points;
        for (const Rgb& c : *there)
          dark = std::max({dark, std::abs(c.r), std::abs(c.g), std::abs(c.b)});
      }
  EXPECT_GT(dark_points, 300);
  EXPECT_GT(lit, 0.1f);
  EXPECT_LT(dark, 1e-3f * lit) << "dark " << dark << " lit " << lit;
}

TEST(Leak, dark_room_beside_a_lit_one_stays_dark_behind_a_wall_of_one_centimetre) {
  const SkyPartition partition = *SkyPartition::uniform(64);
  expect_dark_behind_the_wall(partition, sky_towards_minus_y(partition), 2.0);
}

// A factorisation is not exact, but its error stays on its side: no brick holds probes of both rooms.
TEST(Leak, so_does_it_under_a_fine_sky) {
  const SkyPartition partition = *SkyPartition::fine(1024);
  for (const double second_m : {2.0, 3.2}) // the wall halves the probes, or lies between
    expect_dark_behind_the_wall(partition, nodes_towards_minus_y(partition), second_m);
}

} // namespace
} // namespace daylit::precompute
