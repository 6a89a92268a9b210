// The room's own light: what is kept on its planes against evaluation at each point.

#include "runtime/indirect/room_light.h"

#include <deque>

#include <gtest/gtest.h>

#include "runtime/indirect/lit_points.h"
#include "runtime/indirect/room_planes.h"
#include "test_scene.h"

namespace daylit {
namespace {

/// Probes every half metre in the box room; the light field grows along x and z.
struct LitRoom {
  BasisVolume volume;
  LightField field;
  LitRoom() : volume{} {
    volume.partition = *SkyPartition::uniform(64);
    volume.room = test::box_room();
    volume.apertures = test::box_window();
    ProbeSet& p = volume.probes;
    p.is_grid = true;
    p.count = {8, 10, 5};
    p.spacing = glm::dvec3(0.5);
    for (int k = 0; k < p.count.z; ++k)
      for (int j = 0; j < p.count.y; ++j)
        for (int i = 0; i < p.count.x; ++i) {
          p.positions.emplace_back(0.25 + 0.5 * i, 0.25 + 0.5 * j, 0.25 + 0.5 * k);
          p.valid.push_back(1);
          Sh9Rgb light{};
          light[0] = Rgb(static_cast<float>(1.0 + 0.2 * i + 0.1 * k));
          field.probe.push_back(light);
        }
  }
};

TEST(RoomLight, kept_cells_agree_with_evaluation_at_each_point) {
  LitRoom lit;
  const auto sampler = LightFieldSampler::make(lit.volume);
  ASSERT_TRUE(sampler) << sampler.error().message();
  const RayScene rays = *RayScene::build(lit.volume.room);
  const auto pyramid = sky_map_pyramid(test::overcast_sky());
  const auto cells = aperture_cells(lit.volume.apertures, {{2, 3, 0.3}, 0.2}, pyramid);
  RoomLight room(lit.volume.room, rays, *sampler);
  room.set_frame(lit.field, pyramid, cells, {});
  const glm::dvec3 eye(2.0, 1.0, 1.6);
  double square = 0, mean = 0;
  int count = 0;
  for (int k = 0; k < 400; ++k) {
    const glm::dvec3 w =
        glm::normalize(glm::dvec3(std::sin(0.7 * k), 0.6 * std::cos(0.31 * k) + 0.4, -0.2 - 0.002 * k));
    RayHit hit;
    if (!rays.closest(rays.to_local(eye), glm::vec3(w), 0.0f, 100.0f, hit))
      continue;
    const glm::dvec3 x = eye + static_cast<double>(hit.distance) * w;
    const RoomPoint kept = room.at_surface(hit.triangle, x, w), exact = room.evaluate(hit.triangle, x, w);
    const auto total = [](const RoomPoint& p) {
      return static_cast<double>(p.indirect_irradiance.g + p.open_sky_irradiance.g);
    };
    square += std::pow(total(kept) - total(exact), 2.0);
    mean += total(exact);
    ++count;
  }
  EXPECT_GT(count, 300);
  EXPECT_GT(room.cells_kept(), 50u);
  EXPECT_LT(std::sqrt(square / count) / (mean / count), 0.005);
}

TEST(RoomLight, a_new_sky_renews_what_was_kept) {
  LitRoom lit;
  const auto sampler = LightFieldSampler::make(lit.volume);
  ASSERT_TRUE(sampler);
  const RayScene rays = *RayScene::build(lit.volume.room);
  SkyMap sky = test::overcast_sky();
  const auto pyramid = sky_map_pyramid(sky);
  for (Rgb& c : sky.radiance)
    c *= 3.0f;
  const auto brighter = sky_map_pyramid(sky);
  const auto cells = aperture_cells(lit.volume.apertures, {{2, 3, 0.3}, 0.2}, pyramid);
  RoomLight room(lit.volume.room, rays, *sampler);
  const glm::dvec3 eye(2.0, 1.0, 1.6), down = glm::normalize(glm::dvec3(0.1, 1.0, -1.0));
  room.set_frame(lit.field, pyramid, cells, {});
  const float before = room.at(eye, down)->open_sky_irradiance.g;
  room.set_frame(lit.field, brighter, cells, {});
  EXPECT_NEAR(room.at(eye, down)->open_sky_irradiance.g, 3.0f * before, 1e-4f * before);
  const auto fewer = aperture_cells(lit.volume.apertures, {{1, 2, 0.3}, 0.2}, brighter);
  room.set_frame(lit.field, brighter, {}, {}, true);
  EXPECT_EQ(room.at(eye, down)->open_sky_irradiance.g, 0.0f) << "the same sky through no window";
  room.set_frame(lit.field, brighter, fewer, {}, true);
  EXPECT_NEAR(room.at(eye, down)->open_sky_irradiance.g, 3.0f * before, 0.05f * before);
  EXPECT_GT(before, 0.0f);
}

/// Of the box room, and points on its floor.
struct FloorPoints {
  LitRoom lit;
  LightFieldSampler sampler = *LightFieldSampler::make(lit.volume);
  RayScene rays = *RayScene::build(lit.volume.room);
  RoomLight room{lit.volume.room, rays, sampler};
  std::vector<SkyMap> pyramid;
  std::vector<ApertureCell> cells;
  static constexpr std::size_t kCount = 37; // two and a bit of sixteen
  static glm::dvec3 at(std::size_t k) { return {0.3 + 0.09 * static_cast<double>(k), 2.0, 0.0}; }

  void set_sky(float factor) {
    SkyMap sky = test::overcast_sky();
    for (Rgb& c : sky.radiance)
      c *= factor;
    pyramid = sky_map_pyramid(sky);
    cells = aperture_cells(lit.volume.apertures, {{2, 3, 0.3}, 0.2}, pyramid);
    room.set_frame(lit.field, pyramid, cells, {});
  }
  RoomPoint alone(std::size_t k) const { return room.evaluate(0, at(k), {0, 0, -1}); }
};

void expect_same(const RoomPoint& a, const RoomPoint& b, std::size_t k) {
  EXPECT_EQ(a.indirect_irradiance, b.indirect_irradiance) << k;
  EXPECT_EQ(a.open_sky_irradiance, b.open_sky_irradiance) << k;
  EXPECT_EQ(a.reflectance, b.reflectance) << k;
}

TEST(RoomLight, many_points_at_once_have_the_bits_of_each_alone) {
  FloorPoints floor;
  floor.set_sky(1.0f);
  std::vector<RoomLight::KnownPoint> points;
  std::vector<const RoomLight::KnownPoint*> all;
  const glm::dvec3 up(0, 0, 1);
  for (std::size_t k = 0; k < FloorPoints::kCount; ++k)
    points.push_back({0, FloorPoints::at(k), up, floor.room.probes_at(FloorPoints::at(k) + kAirGap_m * up)});
  for (const RoomLight::KnownPoint& p : points)
    all.push_back(&p);
  std::vector<RoomPoint> light(all.size());
  floor.room.evaluate(all, floor.cells, light);
  for (std::size_t k = 0; k < all.size(); ++k) {
    EXPECT_GT(light[k].open_sky_irradiance.g, 0.0f);
    expect_same(light[k], floor.alone(k), k);
  }
}

TEST(LitPoints, of_each_sky_have_the_bits_of_evaluation_and_are_kept_while_asked_for) {
  FloorPoints floor;
  LitPoints lit(floor.room);
  std::deque<LitPoint> points(FloorPoints::kCount);
  const std::size_t asked[] = {37, 37, 5, 5, 20}; // under one sky after the other
  const std::size_t kept[] = {37, 37, 37, 5, 20};
  for (std::size_t sky = 0; sky < std::size(asked); ++sky) {
    floor.set_sky(static_cast<float>(sky + 1));
    lit.sky_changed(floor.cells);
    for (std::size_t k = 0; k < asked[sky]; ++k)
      expect_same(lit.light(points[k], 0, FloorPoints::at(k), {0, 0, 1}), floor.alone(k), k);
    EXPECT_EQ(lit.size(), kept[sky]) << sky;
  }
}

} // namespace
} // namespace daylit
