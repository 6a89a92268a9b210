// Real things that the room's model lacks, in rooms where they are known in closed form: a plate that stands before the
// wall at y = 5 of the box room, seen by a camera that looks along +y.

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "runtime/depth/depth_walk.h"
#include "runtime/depth/real_things.h"
#include "runtime/depth/thing_layer.h"
#include "runtime/depth/thing_light.h"
#include "runtime/reflect/room_seen.h"
#include "surrounded.h"

namespace daylit {
namespace {

using test::Surrounded;

constexpr int kWidth = 160, kHeight = 120;
constexpr double kWall_m = 4.0, kPlate_m = 2.0; // before the camera

/// A camera at y = 1, and what its depth picture holds.
struct View {
  Room room = Surrounded::white_box(true).room; // its window is wall
  RayScene rays = *RayScene::build(room);
  RenderCamera camera = test::look_at({0.8, 1.0, 0.5}, {0.8, 4.0, 0.5}, kWidth, kHeight, 0.8);
  LensModel lens = ideal_pinhole(kWidth, kHeight, 0.8);
  DepthPicture depth{kWidth, kHeight, std::vector<float>(kWidth* kHeight, static_cast<float>(kWall_m))};
  RealThings things;

  /// Pixels of a plate parallel to the picture: columns 60..99, rows 40..79.
  static bool on_plate(int x, int y) { return x >= 60 && x < 100 && y >= 40 && y < 80; }
  void set(const std::function<float(int x, int y)>& z) {
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        depth.z_m[static_cast<std::size_t>(y * kWidth + x)] = z(x, y);
  }
  void put_plate() {
    set([](int x, int y) { return static_cast<float>(on_plate(x, y) ? kPlate_m : kWall_m); });
  }
  void find(double noise_m = 0.0) { things.find(depth, noise_m, camera, lens, rays, nullptr); }
  glm::dvec3 world(double x, double y, double z) const {
    const glm::dvec3 p((x - camera.cx) / camera.fx * z, (y - camera.cy) / camera.fy * z, z);
    return camera.eye() + glm::dmat3(camera.world_from_camera) * p;
  }
};

TEST(RealThings, are_what_stands_before_the_model_and_nothing_else) {
  View v;
  v.put_plate();
  v.find();
  EXPECT_EQ(v.things.pixels(), 40u * 40u);
  EXPECT_FLOAT_EQ(v.things.z(60, 40), static_cast<float>(kPlate_m));
  EXPECT_EQ(v.things.z(59, 40), 0.0f);
  EXPECT_TRUE(v.things.is_inner(61, 41));
  EXPECT_FALSE(v.things.is_inner(60, 60));
}

TEST(RealThings, are_not_seen_in_holes_nor_where_depth_and_model_agree_to_the_noise) {
  View v;
  v.set([](int, int) { return 0.0f; });
  v.find();
  EXPECT_FALSE(v.things.any()) << "holes";
  v.set([](int, int) { return static_cast<float>(kWall_m - 0.025); });
  v.find();
  EXPECT_FALSE(v.things.any()) << "the model is right to 3 cm";
  v.set([](int, int) { return static_cast<float>(kWall_m + 0.5); });
  v.find();
  EXPECT_FALSE(v.things.any()) << "behind the model's wall";
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.002 * kWall_m * kWall_m);
  v.set([&](int, int) { return static_cast<float>(kWall_m + noise(random)); });
  v.find(0.002);
  EXPECT_FALSE(v.things.any()) << "noise of the deviation that was said: " << v.things.pixels() << " pixels";
}

TEST(RealThings, a_depth_picture_of_half_the_size_stands_for_squares_of_the_photograph) {
  View v;
  v.put_plate();
  DepthPicture half{kWidth / 2, kHeight / 2, {}};
  for (int y = 0; y < half.height; ++y)
    for (int x = 0; x < half.width; ++x)
      half.z_m.push_back(v.depth.at(2 * x, 2 * y));
  v.depth = half;
  v.find();
  EXPECT_EQ(v.things.pixels(), 40u * 40u);
  EXPECT_GT(v.things.z(99, 79), 0.0f);
  EXPECT_EQ(v.things.z(100, 79), 0.0f);
}

TEST(RealThings, through_a_distorted_lens_lie_where_the_photograph_shows_them) {
  View v;
  v.lens.distortion = {-0.2, 0.05, 0, 0, 0, 0, 0, 0};
  v.camera = *make_render_camera(v.lens, v.camera.world_from_camera, kWidth, kHeight);
  v.put_plate();
  v.find();
  const auto corner = v.lens.unproject({62.0, 42.0});
  ASSERT_TRUE(corner);
  const glm::dvec3 on_plate = v.camera.eye() + glm::dmat3(v.camera.world_from_camera) * (*corner / corner->z * 2.5);
  EXPECT_TRUE(v.things.hide(on_plate)) << "half a metre behind the plate, in its pixel (62, 42)";
  const auto beside = v.lens.unproject({57.0, 42.0});
  EXPECT_FALSE(v.things.hide(v.camera.eye() + glm::dmat3(v.camera.world_from_camera) * (*beside / beside->z * 2.5)));
}

TEST(RealThings, normals_of_a_slanted_plane_are_right_to_a_tenth_of_a_radian_in_the_noise_of_a_depth_camera) {
  for (const double noise_m : {0.0, 0.002}) {
    View v;
    const glm::dvec3 n = glm::normalize(glm::dvec3(0.5, -0.3, -0.8)); // camera frame, n . P = -1.4
    std::mt19937 random(7);
    std::normal_distribution<double> noise(0.0, 1.0);
    v.set([&](int x, int y) {
      const glm::dvec3 ray((x - v.camera.cx) / v.camera.fx, (y - v.camera.cy) / v.camera.fy, 1.0);
      const double z = -1.4 / glm::dot(n, ray);
      return static_cast<float>(z + noise_m * z * z * noise(random));
    });
    v.find(noise_m);
    const glm::dvec3 expected = glm::dmat3(v.camera.world_from_camera) * n;
    for (const glm::ivec2 pixel : {glm::ivec2(80, 60), glm::ivec2(40, 30), glm::ivec2(120, 90)}) {
      const auto point = v.things.point(pixel.x, pixel.y);
      ASSERT_TRUE(point);
      EXPECT_GT(glm::dot(point->normal, expected), std::cos(noise_m > 0.0 ? 0.1 : 1e-3)) << noise_m;
    }
  }
}

TEST(DepthWalk, a_ray_meets_the_front_where_it_is) {
  View v;
  v.put_plate();
  v.find();
  const glm::dvec3 target = v.world(80, 60, kPlate_m);
  for (const glm::dvec3 from : {glm::dvec3(1.2, 1.5, 0.9), glm::dvec3(0.3, 2.0, 0.2), v.camera.eye()}) {
    const double distance = glm::length(target - from);
    const auto met = first_thing(v.things, {from, glm::vec3((target - from) / distance)}, 10.0);
    ASSERT_TRUE(met) << from.x;
    EXPECT_NEAR(*met, distance, 0.02) << "to a pixel, 11 mm";
    EXPECT_FALSE(first_thing(v.things, {from, glm::vec3((target - from) / distance)}, 0.8 * distance));
  }
}

TEST(DepthWalk, a_ray_that_passes_beside_or_far_behind_meets_nothing) {
  View v;
  v.put_plate();
  v.find();
  const glm::vec3 right(1.0f, 0.0f, 0.0f);
  EXPECT_FALSE(first_thing(v.things, {{-0.5, 2.5, 0.5}, right}, 10.0)) << "before it";
  EXPECT_FALSE(first_thing(v.things, {{-0.5, 3.8, 0.5}, right}, 10.0)) << "further behind it than it is wide";
  EXPECT_FALSE(first_thing(v.things, {{-0.5, 3.0, 1.2}, right}, 10.0)) << "above it";
  EXPECT_TRUE(first_thing(v.things, {{-0.5, 3.1, 0.5}, right}, 10.0)) << "through its side";
  v.set([](int x, int y) { // and a bar of three columns, as thick as these are wide
    return static_cast<float>(View::on_plate(x, y) || (y >= 40 && y < 80 && x >= 120 && x < 123) ? kPlate_m : kWall_m);
  });
  v.find();
  const glm::dvec3 behind = v.world(121, 60, kPlate_m + 0.1);
  EXPECT_FALSE(first_thing(v.things, {behind + glm::dvec3(0.5, 0.0, 0.0), -right}, 0.7)) << "0.1 m behind the bar";
  View empty;
  empty.find();
  EXPECT_FALSE(first_thing(empty.things, {empty.camera.eye(), {0.0f, 1.0f, 0.0f}}, 10.0));
}

TEST(DepthWalk, a_ray_from_behind_meets_the_back_and_one_from_within_leaves_first) {
  View v;
  v.put_plate();
  v.find();
  const auto thickness = static_cast<double>(v.things.thickness_m(80, 60));
  EXPECT_NEAR(thickness, 40.0 * kPlate_m / v.camera.fx, 0.02) << "as it is wide";
  const glm::vec3 to_camera(0.0f, -1.0f, 0.0f);
  const auto met = first_thing(v.things, {{0.8, 4.5, 0.5}, to_camera}, 10.0);
  ASSERT_TRUE(met);
  EXPECT_NEAR(*met, 1.5 - thickness, 0.02);
  EXPECT_FALSE(first_thing(v.things, {{0.8, 3.1, 0.5}, {1.0f, 0.0f, 0.0f}}, 10.0));
}

/// A sphere of 0.15 m somewhere, and the photograph of a bright plate before a dark wall.
struct Layered : View {
  Surrounded surrounded{0.15f};
  VirtualObjects objects;
  RgbImage photo{kWidth, kHeight, Rgb(0.2f)};

  void put_sphere(const glm::dvec3& at) {
    glm::dmat4 world_from_object(1.0);
    world_from_object[3] = glm::dvec4(at, 1.0);
    objects = {};
    objects.surface = test::place(surrounded.mesh, at);
    VirtualObjects::Part part;
    part.model = std::make_shared<const VirtualObjects::Model>(
        VirtualObjects::Model{surrounded.mesh, {}, Surrounded::rays_of(surrounded.mesh)});
    part.world_from_object = world_from_object;
    objects.parts.push_back(std::move(part));
    objects.find_bounds(0);
  }
  ThingLayer layer() const {
    ThingLayer made;
    ThingLayerMaker(things, camera, photo)
        .make(
            ObjectRays(objects), [](int, int) { return 1.0f; }, made);
    return made;
  }
  static std::size_t index(int x, int y) { return static_cast<std::size_t>(y * kWidth + x); }
};

TEST(ThingLayer, hides_an_object_behind_a_thing_and_not_one_before_it) {
  Layered v;
  v.put_plate();
  v.find();
  v.put_sphere(v.world(80, 60, kPlate_m + 0.5));
  EXPECT_EQ(v.layer().hides[Layered::index(80, 60)], 1.0f);
  EXPECT_EQ(v.layer().hides[Layered::index(20, 60)], 0.0f) << "beside the plate";
  v.put_sphere(v.world(80, 60, kPlate_m - 0.5));
  EXPECT_EQ(v.layer().hides[Layered::index(80, 60)], 0.0f);
  EXPECT_EQ(v.layer().part[Layered::index(80, 60)], 1.0f);
}

TEST(ThingLayer, a_surface_within_the_noise_of_the_thing_is_not_hidden) {
  Layered v;
  v.put_plate();
  v.find(0.002);
  v.put_sphere(v.world(80, 60, kPlate_m + 0.15 - 1e-3)); // its front is 1 mm before the plate
  EXPECT_EQ(v.layer().hides[Layered::index(80, 60)], 0.0f);
  const double tolerance = v.things.tolerance_m(kPlate_m);
  EXPECT_NEAR(tolerance, 0.002 + 3.0 * 0.002 * 4.0, 1e-12);
  v.put_sphere(v.world(80, 60, kPlate_m + 0.15 + 0.5 * tolerance));
  EXPECT_NEAR(v.layer().hides[Layered::index(80, 60)], 0.5f, 0.1f) << "between: not all at once";
}

TEST(ThingLayer, an_edge_is_as_soft_as_the_photograph_shows_it) {
  Layered v;
  v.put_plate();
  v.find();
  v.put_sphere(v.world(60, 60, kPlate_m + 1.0));
  const Rgb bright(0.8f, 0.6f, 0.4f), dark(0.1f, 0.2f, 0.1f);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      v.photo.at(x, y) = View::on_plate(x, y) ? bright : dark;
  for (int y = 42; y < 78; ++y)
    v.photo.at(60, y) = 0.3f * bright + 0.7f * dark; // the plate fills three tenths of its first column
  const ThingLayer layer = v.layer();
  EXPECT_NEAR(layer.part[Layered::index(60, 60)], 0.3f, 1e-4f);
  EXPECT_NEAR(layer.hides[Layered::index(60, 60)], 0.3f, 1e-4f);
  EXPECT_EQ(layer.part[Layered::index(61, 60)], 1.0f);
  EXPECT_NEAR(layer.part[Layered::index(59, 60)], 0.0f, 1e-4f);
  // photo (1 - c (1 - a)) + a (1 - a) c (F - B), c = 1, is what the plate alone sends: a F.
  const auto edge = std::ranges::find(layer.edges, Layered::index(60, 60), &std::pair<std::size_t, Rgb>::first);
  ASSERT_NE(edge, layer.edges.end());
  const Rgb left = 0.3f * v.photo.at(60, 60) + edge->second;
  EXPECT_NEAR(left.r, 0.3f * bright.r, 1e-4f);
  EXPECT_NEAR(left.g, 0.3f * bright.g, 1e-4f);
}

TEST(ThingLayer, an_edge_that_the_photograph_does_not_show_is_smoothed_over_its_pixels) {
  Layered v;
  v.put_plate();
  v.find();
  v.put_sphere(v.world(60, 60, kPlate_m + 1.0));
  const ThingLayer layer = v.layer(); // one colour everywhere
  EXPECT_FLOAT_EQ(layer.part[Layered::index(60, 60)], 0.75f);
  EXPECT_FLOAT_EQ(layer.part[Layered::index(59, 60)], 0.25f);
  EXPECT_TRUE(layer.edges.empty());
}

TEST(ThingLight, only_a_point_in_the_shadow_of_an_object_loses_light) {
  Layered v;
  v.put_sphere({2.0, 3.0, 1.2});
  LightSet lights;
  const glm::dvec3 towards = glm::normalize(glm::dvec3(0.0, 2.0, 0.4)); // through the window
  lights.sun.push_back({towards, Rgb(5.0f)});
  lights.sun_found = true;
  const ApertureCrossings windows(test::box_window());
  const RayScene rays = *RayScene::build(test::box_room());
  const ObjectRays objects(v.objects);
  const ThingLight light{rays,   v.surrounded.room_light, lights, v.surrounded.pyramid, v.surrounded.cells, windows,
                         objects};
  const glm::dvec3 behind = glm::dvec3(2.0, 3.0, 1.2) - 0.6 * towards;
  // All of the sun is lost there, the indirect light pi L stays.
  const double indirect = std::numbers::pi * Surrounded::kRadiance, sun = 5.0 * towards.y;
  const Rgb ratio = light.ratio({behind, {0.0, 1.0, 0.0}});
  EXPECT_NEAR(static_cast<double>(ratio.g), indirect / (indirect + sun), 0.01);
  EXPECT_EQ(light.ratio({behind + glm::dvec3(0.4, 0.0, 0.0), {0.0, 1.0, 0.0}}), Rgb(1.0f)) << "beside the shadow";
  EXPECT_EQ(light.ratio({behind, {0.0, -1.0, 0.0}}), Rgb(1.0f)) << "turned away from the sun";
}

/// A ray's way through the room with the plate in it, whose photograph is red before a blue wall.
struct MirroredPlate : Layered {
  Composite composite;
  ApertureCrossings windows{std::vector<Aperture>{}};
  std::optional<DetectedSun> sun;
  PhotoScale scale;

  MirroredPlate() {
    put_plate();
    find();
    put_sphere({2.0, 1.5, 0.5});
    composite.picture = RgbImage(kWidth, kHeight, Rgb(0.1f, 0.1f, 0.9f));
    composite.coverage.assign(composite.picture.texels.size(), 0.0f);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        if (on_plate(x, y))
          composite.picture.at(x, y) = Rgb(0.9f, 0.1f, 0.1f);
  }
  /// From a place to a point.
  Rgb seen(const glm::dvec3& from, const glm::dvec3& to, bool with_depth = true) const {
    const PhotographedRoom photograph(composite, camera, lens, scale, 1e9f);
    const ObjectRays object_rays(objects);
    const RoomSeen room_seen{surrounded.volume.room,
                             surrounded.rays,
                             surrounded.room_light,
                             nullptr,
                             surrounded.pyramid,
                             sun,
                             windows,
                             object_rays,
                             &photograph,
                             with_depth ? &things : nullptr};
    std::array<RoomRay, 1> ray;
    ray[0].ray = {from, glm::vec3(glm::normalize(to - from))};
    room_seen.find_ends(ray);
    room_seen.find_radiance(ray);
    return ray[0].radiance;
  }
};

TEST(RoomSeen, a_mirrored_ray_sees_a_thing_that_only_the_depth_picture_knows) {
  const MirroredPlate v;
  const glm::dvec3 from(1.6, 1.5, 0.5), to = v.world(80, 60, kPlate_m);
  EXPECT_NEAR(v.seen(from, to).r, 0.9f, 1e-3f);
  EXPECT_NEAR(v.seen(from, to, false).r, 0.1f, 1e-3f) << "the wall behind it";
}

TEST(RoomSeen, the_wall_behind_a_thing_does_not_take_the_things_colour) {
  const MirroredPlate v;
  const glm::dvec3 wall = v.world(80, 60, kWall_m), from(0.8, 4.5, 0.5); // from behind the plate
  EXPECT_NEAR(v.seen(from, wall, false).r, 0.9f, 1e-3f) << "the model does not know that the camera does not see it";
  EXPECT_NEAR(v.seen(from, wall).r, static_cast<float>(Surrounded::kRadiance), 0.01f);
}

TEST(RoomSeen, a_thing_behind_an_object_in_the_photograph_is_not_seen_as_the_object) {
  MirroredPlate v;
  const glm::dvec3 from(1.6, 1.5, 0.5), to = v.world(80, 60, kPlate_m);
  for (int y = 50; y < 70; ++y)
    for (int x = 70; x < 90; ++x)
      v.composite.coverage[Layered::index(x, y)] = 1.0f;
  EXPECT_NEAR(v.seen(from, to).r, 0.1f, 1e-3f) << "the ray goes on to the wall";
}

} // namespace
} // namespace daylit
