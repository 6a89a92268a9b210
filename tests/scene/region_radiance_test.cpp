#include <chrono>
#include <cmath>
#include <numbers>
#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <hwy/targets.h>
#include <tbb/global_control.h>

#include "scene/sky/region_texels.h"
#include "scene/sky/sky_partition.h"
#include "tests/scene/test_volumes.h"

namespace daylit {
namespace {

constexpr double kPi = std::numbers::pi;

FisheyeProjection tilted_fisheye(int width, int height, double field_of_view) {
  FisheyeProjection p;
  p.lens = ideal_fisheye(width, height, field_of_view);
  const glm::dvec3 z = glm::normalize(glm::dvec3(0.3, 0.2, 0.8)), x = glm::normalize(glm::cross(z, {0, 1, 0}));
  p.lens.world_from_camera = glm::dmat3(x, glm::cross(z, x), z);
  return p;
}

SkyImage make_sky(const RgbImage& image, const SkyProjection& projection, float albedo = 0.2f) {
  auto sky = SkyImage::make(image, projection, {GroundFill::Kind::albedo, albedo});
  EXPECT_TRUE(sky) << sky.error().message();
  return *sky;
}

RgbImage noise(int width, int height) {
  RgbImage image(width, height);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0, 1);
  for (Rgb& t : image.texels)
    t = Rgb(unit(random), unit(random), unit(random));
  return image;
}

/// By name, and the unequal ones that have none.
SkyPartition partition_of(const std::string& text) {
  return text == "rectangles" ? test::rectangles() : *SkyPartition::parse(text);
}

/// Sum of L times solid angle over regions, and over pixels.
std::pair<glm::dvec3, glm::dvec3> energies(const SkyImage& sky, const SkyPartition& partition) {
  const std::vector<Rgb> mean = region_radiance(sky, partition);
  glm::dvec3 regions{0.0}, pixels{0.0};
  for (int r = 0; r < partition.size(); ++r)
    regions += partition.solid_angle_sr(r) * glm::dvec3(mean[static_cast<std::size_t>(r)]);
  for (std::size_t i = 0; i < sky.image().texels.size(); ++i)
    pixels += double(sky.solid_angle_sr()[i]) * glm::dvec3(sky.image().texels[i]);
  return {regions, pixels};
}

TEST(RegionRadiance, constant_sky_gives_that_constant_for_every_projection) {
  const SkyProjection projections[] = {EquirectProjection{}, EquirectProjection{0.123}, AngularProjection{},
                                       AngularProjection{{0.3, 1, 0.2}, {0, 0, 1}, 1.0}, tilted_fisheye(97, 97, 3.3)};
  for (const SkyProjection& projection : projections) {
    const SkyImage sky = make_sky(RgbImage(97, 97, Rgb(0.25f, 3.0f, 700.0f)), projection, 1.0f);
    for (const char* text : {"uniform:2", "uniform:64", "uniform:1024", "tregenza", "reinhart:4", "rectangles"})
      for (const Rgb& mean : region_radiance(sky, partition_of(text))) {
        ASSERT_NEAR(mean.r / 0.25f, 1.0f, 1e-6f) << text << " projection " << projection.index();
        ASSERT_NEAR(mean.g / 3.0f, 1.0f, 1e-6f);
        ASSERT_NEAR(mean.b / 700.0f, 1.0f, 1e-6f);
      }
  }
}

TEST(RegionRadiance, equirect_keeps_the_energy_of_every_image) {
  for (const double rotation : {0.0, 0.2, -3.0})
    for (const char* text :
         {"uniform:2", "uniform:64", "uniform:1024", "tregenza", "reinhart:2", "reinhart:12", "rectangles"}) {
      const SkyImage sky = make_sky(noise(150, 75), EquirectProjection{rotation});
      const auto [regions, pixels] = energies(sky, partition_of(text));
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(regions[c] / pixels[c], 1.0, 1e-6) << text << " rotation " << rotation;
    }
}

TEST(RegionRadiance, angular_map_keeps_the_energy) {
  const SkyImage sky = make_sky(noise(256, 256), AngularProjection{});
  for (const char* text : {"uniform:64", "uniform:1024", "tregenza", "rectangles"}) {
    const auto [regions, pixels] = energies(sky, partition_of(text));
    EXPECT_NEAR(regions.g / pixels.g, 1.0, 2e-4) << text; // pixels on borders are split, not clipped
  }
}

TEST(RegionRadiance, equirect_agrees_with_brute_force_sampling) {
  const SkyImage sky = make_sky(noise(30, 15), EquirectProjection{0.4});
  for (const SkyPartition& partition : {SkyPartition::tregenza(), test::rectangles()}) {
    const std::vector<Rgb> mean = region_radiance(sky, partition);
    constexpr int kSide = 400;
    for (int r = 0; r < partition.size(); r += partition.size() < 13 ? 1 : 13) {
      double sum = 0;
      for (int i = 0; i < kSide; ++i)
        for (int j = 0; j < kSide; ++j)
          sum += double(sky.radiance(partition.sample(r, (i + 0.5) / kSide, (j + 0.5) / kSide)).g);
      EXPECT_NEAR(double(mean[static_cast<std::size_t>(r)].g), sum / (kSide * kSide), 3.5e-3)
          << r; // what the samples miss at the edges of pixels: measured 2.6e-3, and twice that with half as many a
                // side
    }
  }
}

TEST(RegionRadiance, fisheye_agrees_with_equirect_of_the_same_sky) {
  const auto overcast = [](const glm::dvec3& d) { return Rgb(float(d.z > 0 ? (1 + 2 * d.z) / 3 : 0.1 + 0.05 * d.x)); };
  const auto render = [&](int width, int height, const SkyProjection& projection) {
    RgbImage image(width, height);
    const auto g = *SkyGeometry::make(width, height, projection);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        if (const auto d = g->direction({double(x), double(y)}))
          image.at(x, y) = overcast(*d);
    return make_sky(image, projection);
  };
  const SkyImage reference = render(512, 256, EquirectProjection{});
  const SkyPartition partition = *SkyPartition::uniform(64);
  const std::vector<Rgb> expected = region_radiance(reference, partition);
  const SkyImage angular = render(400, 400, AngularProjection{{1, 0.5, 0}, {0, 0, 1}, 0.0});
  const std::vector<Rgb> from_angular = region_radiance(angular, partition);
  const SkyImage fisheye = render(400, 400, tilted_fisheye(400, 400, kPi * 190 / 180));
  const RegionSums sums = RegionSums::make(fisheye.geometry(), partition);
  const std::vector<Rgb> from_fisheye = sums.reduce(fisheye);
  for (std::size_t r = 0; r < expected.size(); ++r) {
    EXPECT_NEAR(from_angular[r].g, expected[r].g, 1e-3f) << r;
    if (sums.covered_fraction(static_cast<int>(r)) == 1.0) {
      EXPECT_NEAR(from_fisheye[r].g, expected[r].g, 1e-3f) << r;
    }
  }
}

TEST(RegionRadiance, uncovered_part_of_a_region_takes_the_fill) {
  // A fish-eye of 180 degrees that looks up: nothing below the horizon is seen.
  FisheyeProjection up;
  up.lens = ideal_fisheye(200, 200, kPi);
  up.lens.world_from_camera = glm::dmat3(1, 0, 0, 0, -1, 0, 0, 0, 1);
  const SkyImage sky = make_sky(RgbImage(200, 200, Rgb(5.0f)), up, 0.2f);
  const SkyPartition partition = SkyPartition::tregenza();
  const std::vector<Rgb> mean = region_radiance(sky, partition);
  for (int r = 0; r < partition.size(); ++r)
    EXPECT_NEAR(mean[static_cast<std::size_t>(r)].g, partition.centre(r).z > 0 ? 5.0f : 1.0f, 1e-4f) << r;
}

/// Draws a disc as area coverage: each pixel takes its share of the disc, so that the energy is that of the disc.
void splat_sun(RgbImage& image, const SkyGeometry& geometry, double x, double y, double radius_px, double energy) {
  constexpr int kSplit = 64;
  std::vector<double> share(image.texels.size());
  double total = 0;
  for (int py = 0; py < image.height; ++py)
    for (int px = 0; px < image.width; ++px) {
      if (std::hypot(px - x, py - y) > radius_px + 1)
        continue;
      int inside = 0;
      for (int k = 0; k < kSplit * kSplit; ++k)
        inside += std::hypot(px - 0.5 + (k % kSplit + 0.5) / kSplit - x, py - 0.5 + (k / kSplit + 0.5) / kSplit - y) <
                          radius_px
                      ? 1
                      : 0;
      const std::size_t i = static_cast<std::size_t>(py * image.width + px);
      share[i] = inside * double(geometry.solid_angle_sr()[i]);
      total += share[i];
    }
  for (std::size_t i = 0; i < share.size(); ++i)
    if (share[i] > 0)
      image.texels[i] += Rgb(float(energy * share[i] / total / double(geometry.solid_angle_sr()[i])));
}

TEST(RegionRadiance, a_sun_of_1_5_pixels_keeps_its_energy_at_every_sub_pixel_position) {
  const SkyPartition partition = *SkyPartition::uniform(1024);
  const SkyProjection projections[] = {EquirectProjection{}, tilted_fisheye(128, 128, kPi * 190 / 180)};
  for (const SkyProjection& projection : projections) {
    const auto geometry = *SkyGeometry::make(128, 128, projection);
    const RegionSums sums = RegionSums::make(geometry, partition);
    for (int k = 0; k < 64; ++k) {
      RgbImage image(128, 128);
      splat_sun(image, *geometry, 70 + (k % 8) / 8.0, 40 + (k / 8) / 8.0, 0.75, 100.0);
      const SkyImage sky = *SkyImage::make(image, geometry, {GroundFill::Kind::albedo, 0.0f});
      const std::vector<Rgb> mean = sums.reduce(sky);
      const double fill = double(sky.sky_fill_radiance().r);
      double energy = 0;
      for (int r = 0; r < partition.size(); ++r) {
        const double seen = sums.covered_fraction(r), l = double(mean[static_cast<std::size_t>(r)].r);
        const double fill_here = partition.centre(r).z > 0 ? fill : 0.0;
        energy += partition.solid_angle_sr(r) * (l - (1 - seen) * fill_here);
      }
      EXPECT_NEAR(energy / 100.0, 1.0, 1e-3) << "position " << k << " projection " << projection.index();
    }
  }
}

/// Node by node and pixel by pixel, at pixel centres.
std::vector<glm::dvec3> slow_node_sums(const SkyImage& sky, const SkyPartition& nodes) {
  std::vector<glm::dvec3> sums(static_cast<std::size_t>(nodes.size()));
  for (std::size_t i = 0; i < sky.image().texels.size(); ++i)
    if (const double solid_angle = double(sky.solid_angle_sr()[i]); solid_angle > 0)
      if (const auto d = sky.direction({double(i % 300), double(i / 300)}))
        for (const RegionWeight& w : nodes.interpolation(*d))
          sums[static_cast<std::size_t>(w.region)] += solid_angle * w.weight * glm::dvec3(sky.image().texels[i]);
  return sums;
}

TEST(RegionRadiance, spans_of_pixels_give_the_sums_of_single_pixels) {
  RgbImage image = noise(300, 300);
  image.texels[150 * 300 + 90] = Rgb(5e4f); // a sun
  const SkyImage sky = make_sky(image, tilted_fisheye(300, 300, 4.0));
  const SkyPartition nodes = *SkyPartition::fine(1024); // pixels are fine beside these: one point each
  const std::vector<Rgb> mean = region_radiance(sky, nodes);
  const std::vector<glm::dvec3> sums = slow_node_sums(sky, nodes);
  const RegionSums of_sky = RegionSums::make(sky.geometry(), nodes);
  double most = 0, error = 0;
  int whole = 0;
  for (int r = 0; r < nodes.size(); ++r) {
    if (of_sky.covered_fraction(r) < 1)
      continue; // the fill is part of these
    const auto at = static_cast<std::size_t>(r);
    const double expected = sums[at].g / nodes.solid_angle_sr(r), difference = double(mean[at].g) - expected;
    error = std::max(error, std::abs(difference) / std::max(expected, 1e-6));
    most = std::max(most, expected);
    ++whole;
  }
  EXPECT_GT(whole, 500);
  EXPECT_GT(most, 50.0);  // the sun is in one of them
  EXPECT_LT(error, 1e-5); // sums of floats
}

TEST(RegionRadiance, a_sun_alone_is_shared_by_its_four_nodes) {
  constexpr std::size_t kSide = 1000;
  const auto geometry = *SkyGeometry::make(kSide, kSide, tilted_fisheye(kSide, kSide, kPi));
  std::vector<std::size_t> texels; // around the zenith and elsewhere
  const std::size_t zenith = *geometry->texel({0.0, 0.0, 1.0});
  for (std::size_t k = 0; k < 6; ++k)
    texels.insert(texels.end(), {zenith + kSide * (9 * k + 5) + 4 * k, zenith - kSide * (5 * k + 7) + 3 * k,
                                 kSide * (150 * k + 100) + 510});
  for (const int count : {64, 16384}) {
    const SkyPartition nodes = *SkyPartition::fine(count);
    const RegionSums sums = RegionSums::make(geometry, nodes);
    for (const std::size_t texel : texels) {
      const auto to_sun = geometry->direction({double(texel % kSide), double(texel / kSide)});
      if (!to_sun)
        continue;
      RgbImage picture(kSide, kSide);
      picture.texels[texel] = Rgb(0.0f, 1e9f, 0.0f);
      const std::vector<Rgb> mean = sums.reduce(make_sky(picture, tilted_fisheye(kSide, kSide, kPi), 0.0f));
      std::vector<double> expected(mean.size());
      for (const RegionWeight& w : nodes.interpolation(*to_sun))
        expected[static_cast<std::size_t>(w.region)] += w.weight;
      for (std::size_t n = 0; n < mean.size(); ++n) {
        if (sums.covered_fraction(static_cast<int>(n)) < 1) // takes the fill too
          continue;
        const double flux = double(mean[n].g) * nodes.solid_angle_sr(static_cast<int>(n));
        ASSERT_NEAR(flux / (1e9 * double(geometry->solid_angle_sr()[texel])), expected[n], 1e-6)
            << count << " nodes, texel " << texel;
      }
    }
  }
}

TEST(RegionRadiance, regions_that_nobody_needs_are_black_and_the_others_the_same) {
  const SkyImage sky = make_sky(noise(200, 200), tilted_fisheye(200, 200, 3.3));
  for (const SkyPartition& partition : {*SkyPartition::fine(4096), *SkyPartition::uniform(512)}) {
    std::vector<std::uint8_t> needed(static_cast<std::size_t>(partition.size()));
    for (int r = 0; r < partition.size(); ++r)
      needed[static_cast<std::size_t>(r)] = partition.centre(r).x > 0.3 ? 1 : 0;
    const RegionSums all = RegionSums::make(sky.geometry(), partition),
                     some = RegionSums::make(sky.geometry(), partition, needed);
    EXPECT_LT(some.bytes(), all.bytes());
    const std::vector<Rgb> of_all = all.reduce(sky), of_some = some.reduce(sky);
    for (std::size_t r = 0; r < needed.size(); ++r)
      for (int c = 0; c < 3; ++c)
        ASSERT_EQ(of_some[r][c], needed[r] ? of_all[r][c] : 0.0f) << partition.name() << " region " << r;
  }
}

/// The slow twin of the vector loop, with every instruction set that this processor has.
TEST(RegionRadiance, sums_of_runs_are_those_of_the_scalar_twin) {
  const RgbImage picture = noise(37, 11);
  detail::RegionTexels region;
  for (std::uint32_t texel = 0; texel < picture.texels.size(); texel += texel % 23 == 5 ? 3 : 1) // ends with the last
    region.add(texel, 0.25f + 0.01f * static_cast<float>(texel % 7));
  ASSERT_GT(region.runs.size(), 10u);
  ASSERT_EQ(region.runs.back().first + region.runs.back().count, picture.texels.size());
  glm::dvec3 exact(0.0);
  const float* weight = region.weight_sr.data();
  for (const auto& run : region.runs)
    for (std::uint32_t k = 0; k < run.count; ++k)
      exact += double(*weight++) * glm::dvec3(picture.texels[run.first + k]);
  const detail::TexelMatrix matrix(std::vector<detail::RegionTexels>{region, region, {}});
  for (std::int64_t left = hwy::SupportedTargets(); left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    std::array<std::array<double, 3>, 1> sums;
    matrix.sum(1, 2, picture.texels, sums);
    const std::array<double, 3>& sum = sums[0];
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(sum[static_cast<std::size_t>(c)], exact[c], 1e-6 * exact[c]);
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

TEST(RegionRadiance, pictures_of_a_few_pixels_are_reduced) {
  const SkyImage sky = make_sky(noise(4, 2), EquirectProjection{});
  const auto [regions, pixels] = energies(sky, *SkyPartition::uniform(4));
  EXPECT_NEAR(regions.g / pixels.g, 1.0, 1e-4);
}

TEST(RegionRadiance, sums_do_not_depend_on_the_thread_count) {
  const SkyImage sky = make_sky(noise(200, 200), tilted_fisheye(200, 200, 3.3));
  const RegionSums sums = RegionSums::make(sky.geometry(), *SkyPartition::fine(4096));
  const std::vector<Rgb> many = sums.reduce(sky);
  const tbb::global_control single(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(sums.reduce(sky), many);
}

TEST(RegionRadiance, reducing_a_megapixel_takes_milliseconds) {
  const SkyImage sky = make_sky(noise(1448, 724), EquirectProjection{});
  const RegionSums sums = RegionSums::make(sky.geometry(), *SkyPartition::uniform(1024));
  double best_ms = 1e9;
  for (int i = 0; i < 5; ++i) {
    const auto start = std::chrono::steady_clock::now();
    const auto mean = sums.reduce(sky);
    best_ms =
        std::min(best_ms, std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    ASSERT_EQ(mean.size(), 1024u);
  }
  RecordProperty("reduce_ms", std::to_string(best_ms));
  EXPECT_LT(best_ms, 100.0); // a few milliseconds unloaded; the bound only catches a wrong complexity
}

TEST(RegionRadiance, nodes_keep_the_energy_and_the_mean_direction_of_a_small_sun) {
  const SkyPartition nodes = *SkyPartition::fine(1024);
  for (const SkyProjection& projection : {SkyProjection(EquirectProjection{0.3}), SkyProjection(AngularProjection{})})
    for (int k = 0; k < 40; k += 8) {
      const double azimuth = 0.05 * k, altitude = 0.2 + 0.003 * k;
      const glm::dvec3 to_sun(std::cos(azimuth) * std::cos(altitude), std::sin(azimuth) * std::cos(altitude),
                              std::sin(altitude));
      RgbImage image(400, std::holds_alternative<EquirectProjection>(projection) ? 200 : 400);
      const auto geometry = *SkyGeometry::make(image.width, image.height, projection, "sun");
      image.texels[*geometry->texel(to_sun)] = Rgb(1000.0f);
      const SkyImage sky = make_sky(image, projection);
      const std::vector<Rgb> radiance = region_radiance(sky, nodes);
      glm::dvec3 moment(0.0);
      double energy = 0;
      for (int r = 0; r < nodes.size(); ++r) {
        const double flux = double(radiance[static_cast<std::size_t>(r)].g) * nodes.solid_angle_sr(r);
        energy += flux;
        moment += flux * nodes.centre(r);
      }
      const auto texel = *geometry->texel(to_sun);
      EXPECT_NEAR(energy / (1000.0 * double(sky.solid_angle_sr()[texel])), 1.0, 1e-5);
      const auto centre = *geometry->direction({double(texel % 400), double(texel / 400)});
      EXPECT_LT(glm::length(glm::normalize(moment) - centre), 0.002); // nodes are 0.11 apart
    }
}

} // namespace
} // namespace daylit
