#include "radiosity/first_bounce.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "radiosity/detail/aperture_beam.h"
#include "radiosity/surface_mesh.h"
#include "scene/room/glass.h"
#include "tests/radiosity/rooms.h"

namespace daylit::radiosity {
namespace {

using testing::add_box;
using testing::add_quad;
using testing::grey_room;
using testing::room_with_window_hole;
constexpr double kPi = std::numbers::pi;
const Progress kSilent = [](const std::string&, double) { return true; };

struct Lit {
  SurfaceMesh mesh;
  RayScene scene;
  std::vector<Aperture> apertures;
  PatchSet set;
  FirstBounce light;
  FirstBounceReport report;

  /// Flux on all surfaces by one column.
  double flux(std::size_t column, int channel = 1) const {
    double sum = 0;
    for (std::size_t i = 0; i < set.patches.size(); ++i)
      sum += set.patches[i].area_m2 * static_cast<double>(light.row(i, channel)[column]);
    return sum;
  }
};

Lit light_up(const Room& room, int facets, const SkyPartition& partition, std::vector<Aperture> apertures = {}) {
  Lit l;
  l.mesh = *mesh_surfaces(room, {.target_facets = facets});
  l.scene = *facet_scene(l.mesh);
  l.apertures = apertures.empty() ? find_apertures(room, *RayScene::build(room))->list : std::move(apertures);
  l.set = find_patches(room, l.mesh, l.scene, l.apertures);
  l.light = *first_bounce(l.set, l.mesh, l.scene, l.apertures, partition, kSilent, &l.report);
  return l;
}

/// What comes in through an opening of 1 m^2 from a region: integral of the cosine over its directions.
double projected_sr(const SkyPartition& partition, int region, const glm::dvec3& inward) {
  constexpr int n = 64;
  double sum = 0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      sum += std::max(0.0, -glm::dot(partition.sample(region, (i + 0.5) / n, (j + 0.5) / n), inward));
  return sum * partition.solid_angle_sr(region) / (n * n);
}

struct EnergyError {
  double worst = 0, rms = 0;
};

/// Every region's flux against that of its beam, which all of it lands somewhere. Regions that are nearly edge on to
/// the opening are left out: less than a twentieth of their light comes in.
EnergyError energy_error(const Lit& l, const SkyPartition& partition, double area_m2, const glm::dvec3& inward) {
  EnergyError e;
  int count = 0;
  for (std::size_t k = 0; k < l.light.columns(); ++k) {
    const int region = l.light.region[k];
    const double expected = area_m2 * projected_sr(partition, region, inward);
    if (expected < 0.05 * area_m2 * partition.solid_angle_sr(region))
      continue;
    const double error = l.flux(k) / expected - 1;
    e.worst = std::max(e.worst, std::abs(error));
    e.rms += error * error;
    ++count;
  }
  e.rms = std::sqrt(e.rms / count);
  return e;
}

TEST(FirstBounce, every_region_brings_the_energy_of_its_beam) {
  for (const char* name : {"uniform:64", "uniform:1024", "reinhart:4"}) {
    const SkyPartition partition = *SkyPartition::parse(name);
    const Lit l = light_up(room_with_window_hole(0.5f), 800, partition);
    const EnergyError e = energy_error(l, partition, 1.6 * 1.2, {0, 1, 0});
    EXPECT_LT(e.worst, 0.02) << name; // patches are scaled to their form factors, so a region's energy moves a little
    EXPECT_LT(e.rms, 4e-3) << name;
    EXPECT_EQ(l.report.open_sky_patches, 0) << name;
  }
}

TEST(FirstBounce, furniture_takes_its_light_from_the_walls_and_loses_none) {
  Room room = room_with_window_hole(0.5f);
  add_box(room, {1, 1, 0}, {2, 2, 0.8}, 0b111110u, false);
  add_quad(room, {2.5, 1, 0}, {2.5, 3, 0}, {2.5, 3, 1.6}, {2.5, 1, 1.6}); // a screen
  const SkyPartition partition = *SkyPartition::uniform(1024);
  const Lit l = light_up(room, 1500, partition);
  const EnergyError e = energy_error(l, partition, 1.6 * 1.2, {0, 1, 0});
  EXPECT_LT(e.worst, 0.03);
  EXPECT_LT(e.rms, 6e-3);
}

TEST(FirstBounce, a_sun_sized_region_lights_its_patch_of_the_floor_only) {
  const SkyPartition partition = *SkyPartition::uniform(16384); // 1.6 degrees wide
  const Lit l = light_up(room_with_window_hole(0.5f), 1500, partition);
  const glm::dvec3 sun = glm::normalize(glm::dvec3(0.2, -1.0, 0.9));
  const int region = partition.region_of(sun);
  const auto column = std::ranges::find(l.light.region, region) - l.light.region.begin();
  ASSERT_LT(static_cast<std::size_t>(column), l.light.columns());
  const glm::dvec3 w = partition.centre(region);
  double outside = 0, whole = 0;
  for (std::size_t i = 0; i < l.set.patches.size(); ++i) {
    const Patch& e = l.set.patches[i];
    const double flux = e.area_m2 * static_cast<double>(l.light.row(i, 0)[column]);
    whole += flux;
    // A corner near a lit point: back along the sun's direction it passes the hole or a rim of one facet around it.
    const bool near = std::ranges::any_of(e.corner, [&](const glm::dvec3& c) {
      const glm::dvec3 p = c + l.mesh.origin, q = p - p.y / w.y * w;
      return q.x > 1.2 - 0.5 && q.x < 2.8 + 0.5 && q.z > 0.9 - 0.5 && q.z < 2.1 + 0.5;
    });
    outside += near ? 0.0 : flux;
  }
  EXPECT_EQ(outside, 0.0);
  EXPECT_NEAR(whole / (1.6 * 1.2 * projected_sr(partition, region, {0, 1, 0})), 1.0, 0.02);
}

TEST(FirstBounce, colourless_panes_are_kept_as_one_channel_and_coloured_ones_as_three) {
  Room room = room_with_window_hole(0.5f);
  const SkyPartition partition = *SkyPartition::uniform(64);
  const Lit open = light_up(room, 200, partition);
  EXPECT_EQ(open.light.channels, 1);
  EXPECT_EQ(open.light.row(3, 2), open.light.row(3, 0));
  room.materials.push_back({"window", Rgb(0.0f), Rgb(0.9f, 0.6f, 0.3f), true});
  add_quad(room, {1.2, 0, 0.9}, {2.8, 0, 0.9}, {2.8, 0, 2.1}, {1.2, 0, 2.1}, 1);
  const Lit tinted = light_up(room, 200, partition);
  ASSERT_EQ(tinted.light.channels, 3);
  ASSERT_EQ(tinted.light.columns(), open.light.columns());
  for (std::size_t k = 0; k < open.light.columns(); ++k)
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(tinted.flux(k, c), open.flux(k, c) * (0.9 - 0.3 * c), 1e-5 + 1e-4 * open.flux(k, c));
}

TEST(FirstBounce, clear_glass_takes_its_share_from_every_region_by_its_angle) {
  Room room = room_with_window_hole(0.5f);
  const SkyPartition partition = *SkyPartition::uniform(1024);
  const Lit open = light_up(room, 300, partition);
  room.materials.push_back({"window", Rgb(0.0f), Rgb(1.0f), true, 1.52f});
  add_quad(room, {1.2, 0, 0.9}, {2.8, 0, 0.9}, {2.8, 0, 2.1}, {1.2, 0, 2.1}, 1);
  const Lit glazed = light_up(room, 300, partition);
  ASSERT_EQ(glazed.light.region, open.light.region);
  for (std::size_t k = 0; k < open.light.columns(); ++k) {
    const double cosine = -partition.centre(open.light.region[k]).y;
    if (cosine > 0.3) { // regions are 6 degrees wide: beyond, the transmittance bends within one
      EXPECT_NEAR(glazed.flux(k) / open.flux(k), clear_slab_transmittance(cosine, 1.52), 4e-3) << cosine;
    }
  }
}

TEST(FirstBounce, panes_in_a_row_count_once_with_the_transmittances_of_all) {
  const Room room = room_with_window_hole(0.5f);
  const glm::dvec3 size = room.bounds().max;
  const Aperture outer{{{1.2, 0, 0.9}, {2.8, 0, 0.9}, {2.8, 0, 2.1}, {1.2, 0, 2.1}}, {0, 1, 0}, Rgb(0.5f)},
      inner{{{0, 1, 0}, {size.x, 1, 0}, {size.x, 1, size.z}, {0, 1, size.z}}, {0, 1, 0}, Rgb(0.8f)};
  const SkyPartition partition = *SkyPartition::uniform(64);
  const Lit one = light_up(room, 300, partition, {outer}), both = light_up(room, 300, partition, {outer, inner});
  ASSERT_EQ(one.set.patches.size(), both.set.patches.size());
  std::array<double, 2> before{}, behind{}; // the inner pane, on facets that it does not cut
  for (std::size_t i = 0; i < one.set.patches.size(); ++i)
    for (std::size_t k = 0; k < one.light.columns(); ++k) {
      const auto& c = one.set.patches[i].corner;
      const double y0 = std::min({c[0].y, c[1].y, c[2].y}) + one.mesh.origin.y,
                   y1 = std::max({c[0].y, c[1].y, c[2].y}) + one.mesh.origin.y;
      for (const int b : {0, 1}) {
        const double light = one.set.patches[i].area_m2 * double((b == 0 ? one : both).light.row(i, 0)[k]);
        (y1 < 1.0 ? before : behind)[static_cast<std::size_t>(b)] += y1 < 1.0 || y0 > 1.0 ? light : 0.0;
      }
    }
  EXPECT_NEAR(before[1] / before[0], 1.0, 5e-3);
  EXPECT_NEAR(behind[1] / behind[0], 0.8, 5e-3);
}

TEST(FirstBounce, fewer_directions_bring_the_same_energy_of_each_region_with_fewer_rays) {
  Room room = room_with_window_hole(0.5f);
  add_box(room, {1, 1.5, 0}, {2.5, 2.5, 1}, 63u, false);
  const SkyPartition partition = *SkyPartition::uniform(64);
  Lit l = light_up(room, 300, partition);
  FirstBounce many = l.light;
  FirstBounceReport report;
  l.light = *first_bounce(l.set, l.mesh, l.scene, l.apertures, partition, kSilent, &report, {.directions = 2048});
  ASSERT_EQ(l.light.region, many.region);
  EXPECT_LT(static_cast<double>(report.rays), 0.3 * static_cast<double>(l.report.rays));
  for (std::size_t k = 0; k < many.columns(); ++k) {
    const double few = l.flux(k);
    std::swap(l.light, many);
    EXPECT_NEAR(few / l.flux(k), 1.0, 0.03) << k;
    std::swap(l.light, many);
  }
}

TEST(FirstBounce, an_opening_of_many_corners_is_the_same_in_pieces) {
  Room room = grey_room(0.5f);
  add_box(room, {0, 0, 0}, {2, 2, 2}, 0b111101u, true); // no ceiling
  const std::vector<Aperture> four = {{{{0, 0, 2}, {2, 0, 2}, {2, 2, 2}, {0, 2, 2}}, {0, 0, -1}}};
  std::vector<Aperture> many = {{{}, {0, 0, -1}}};
  for (std::size_t side = 0; side < 4; ++side)
    for (int k = 0; k < 5; ++k)
      many[0].corners.push_back(glm::mix(four[0].corners[side], four[0].corners[(side + 1) % 4], k / 5.0));
  ASSERT_GT(aperture_parts(many, glm::dvec3(0.0)).size(), 1u);
  const SkyPartition partition = *SkyPartition::uniform(64);
  const Lit a = light_up(room, 200, partition, four), b = light_up(room, 200, partition, many);
  ASSERT_EQ(a.light.region, b.light.region);
  for (std::size_t k = 0; k < a.light.columns(); ++k)
    EXPECT_NEAR(a.flux(k), b.flux(k), 5e-3 * a.flux(k) + 1e-6);
  double total = 0;
  for (std::size_t k = 0; k < b.light.columns(); ++k)
    total += b.flux(k);
  EXPECT_NEAR(total, kPi * 4, 1e-3 * kPi * 4); // E pi L A through the opening
}

TEST(FirstBounce, a_keyhole_is_not_missed) {
  // A hole of 2 cm, 4 m away: hardly any direction of the sweep goes through it to a small facet.
  Room room = grey_room(0.5f);
  add_box(room, {0, 0, 0}, {4, 4, 3}, 0b111011u, true);
  const std::array<double, 4> x = {0, 1.99, 2.01, 4}, z = {0, 1.49, 1.51, 3};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (i != 1 || j != 1)
        add_quad(room, {x[i], 0, z[j]}, {x[i], 0, z[j + 1]}, {x[i + 1], 0, z[j + 1]}, {x[i + 1], 0, z[j]});
  const Lit l = light_up(room, 1500, *SkyPartition::uniform(64));
  double total = 0;
  for (std::size_t k = 0; k < l.light.columns(); ++k)
    total += l.flux(k);
  EXPECT_GT(l.report.sampled_pairs, 0u);
  EXPECT_NEAR(total / (kPi * 4e-4), 1.0, 5e-3);
}

TEST(FirstBounce, bits_do_not_depend_on_the_number_of_threads) {
  Room room = room_with_window_hole(0.5f);
  add_box(room, {1, 1, 0}, {2, 2, 0.8}, 0b111110u, false);
  set_thread_count(1);
  const Lit one = light_up(room, 300, *SkyPartition::uniform(256));
  set_thread_count(2);
  const Lit two = light_up(room, 300, *SkyPartition::uniform(256));
  set_thread_count(0);
  EXPECT_EQ(one.light.irradiance, two.light.irradiance);
  EXPECT_EQ(one.light.opening, two.light.opening);
}

/// The ground before a house sees the open sky: each small region gives it its own solid angle times the cosine, and a
/// sun is no chance hit.
TEST(FirstBounce, an_open_ground_is_lit_by_small_regions_alike) {
  Room room = room_with_window_hole(0.5f);
  const Bounds house = room.bounds();
  const double low = house.min.z - 1.0;
  add_quad(room, {house.min.x - 30, house.min.y - 30, low}, {house.max.x + 30, house.min.y - 30, low},
           {house.max.x + 30, house.max.y + 30, low}, {house.min.x - 30, house.max.y + 30, low}, 0);
  const SkyPartition sky = *SkyPartition::uniform(2048);
  const Lit l = light_up(room, 300, sky);
  double most = 0;
  int open = 0;
  for (std::size_t i = 0; i < l.set.patches.size(); ++i)
    for (std::size_t k = 0; k < l.light.columns(); ++k) {
      const double cosine = glm::dot(sky.centre(l.light.region[k]), l.set.patches[i].normal);
      if (l.set.patches[i].corner[0].z + l.mesh.origin.z > low + 1e-6 || cosine < 0.3)
        continue;
      most = std::max(most, double(l.light.row(i, 1)[k]) / (cosine * sky.solid_angle_sr(l.light.region[k])));
      ++open;
    }
  EXPECT_GT(open, 10000);
  EXPECT_NEAR(most, 1.0, 0.05);
}

} // namespace
} // namespace daylit::radiosity
