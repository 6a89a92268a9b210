// A floor that mirrors, in a room that is equally bright everywhere: what its photograph shows is D + F L, and under a
// shadow V and an object of radiance L_o it should be V D + F L, or V D + F L_o where the object is mirrored.

#include "runtime/reflect/room_mirror.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "glossy_scene.h"
#include "scene/material/fresnel.h"

namespace daylit {
namespace {

using test::GlossyScene;
using test::Surrounded;

constexpr int kWidth = 60, kHeight = 45; // no multiple of a batch of rays
constexpr float kReflectance = 0.1f;     // of the floor, seen face on
const glm::dvec3 kObject(2.0, 2.5, 0.4);
const Rgb kShadow(0.3f, 0.5f, 0.7f);

ObjectMaterial matte() {
  ObjectMaterial m;
  m.base_colour = Rgb(1.0f);
  m.roughness = 1.0f;
  return m;
}

/// Diffuse part of the floor: no two pixels alike, dark ones among them.
Rgb diffuse(std::size_t i) { return Rgb(0.02f, 0.03f, 0.04f) + Rgb(0.01f * static_cast<float>(i % 17)); }

/// What a pixel shows.
struct Shown {
  float share = 0.0f;       ///< F of the floor; 0: no floor
  double past_object = 0.0; ///< of the mirrored ray, metres from the middle of the object
};

struct GlossyFloor {
  GlossyScene scene{matte()};
  RenderCamera camera = test::look_at({2.0, 0.5, 1.1}, {2.0, 2.4, 0.1}, kWidth, kHeight, 1.0);
  LensModel lens = ideal_pinhole(kWidth, kHeight, 1.0);
  PhotoScale scale{0.5, glm::dmat3(1.0, 0.0, 0.0, 0.0, 0.8, 0.0, 0.0, 0.0, 0.6)};
  RgbImage photo{kWidth, kHeight};
  Composite composite;
  RoomMirror mirror;

  explicit GlossyFloor(bool walls_too = false) {
    Room& room = scene.room.volume.room;
    room.materials.push_back({"stone", Rgb(1.0f), Rgb(1.0f), false});
    room.triangles[0].material = room.triangles[1].material = static_cast<std::uint32_t>(room.materials.size() - 1);
    scene.move_to(kObject);
    send(0.0f);
    std::map<std::string, double> glossy{{"stone", kReflectance}};
    if (walls_too)
      glossy["plaster"] = 0.3;
    mirror = *RoomMirror::make(room, glossy);
    for (std::size_t i = 0; i < photo.texels.size(); ++i)
      photo.texels[i] = diffuse(i) + shown(i).share * before();
    composite.picture = photo;
    composite.touched.assign(photo.texels.size(), 0);
    composite.coverage.assign(photo.texels.size(), 0.0f);
  }
  /// From everywhere on the object.
  void send(float radiance) { std::ranges::fill(scene.sent, TwoSided{Rgb(radiance), Rgb(radiance)}); }
  /// L, in the photograph's scale.
  Rgb before() const { return scale.apply(Rgb(Surrounded::kRadiance)); }
  static WorldRay ray(const RenderCamera& camera, std::size_t i) {
    return {camera.eye(), glm::vec3(camera.direction(glm::dvec2(i % kWidth, i / kWidth)))};
  }
  Shown shown(std::size_t i) const {
    const WorldRay from = ray(camera, i);
    const glm::dvec3 d(from.direction), x = from.origin - from.origin.z / d.z * d;
    if (d.z >= 0.0 || x.x < 0.0 || x.x > 4.0 || x.y > 5.0)
      return {};
    const glm::dvec3 on(d.x, d.y, -d.z), way = kObject - x;
    const float cosine = static_cast<float>(on.z);
    return {fresnel_dielectric(cosine, ior_of(kReflectance)), glm::length(way - glm::dot(way, on) * on)};
  }
  bool misses(std::size_t i) const { return shown(i).past_object > 1.01 * static_cast<double>(GlossyScene::kRadius); }
  bool meets(std::size_t i) const { return shown(i).past_object < 0.97 * static_cast<double>(GlossyScene::kRadius); }
  /// In columns `from` to `to`.
  void cast_shadow(int from = 0, int to = kWidth) {
    for (std::size_t i = 0; i < photo.texels.size(); ++i)
      if (const int x = static_cast<int>(i % kWidth); x >= from && x < to) {
        composite.picture.texels[i] = kShadow * photo.texels[i];
        composite.touched[i] = 1;
      }
  }
  std::size_t draw(Composite& result, bool photographed = false) const {
    const RenderedFrame frame;
    const PhotographedRoom seen(result, camera, lens, scale, 100.0f);
    const RoomSeen& plain = *scene.seen;
    const RoomSeen room{plain.room,    plain.rays,    plain.light,
                        plain.shadow,  plain.pyramid, plain.sun,
                        plain.windows, plain.objects, photographed ? &seen : nullptr,
                        nullptr,       mirror.gloss()};
    const GlossyRays rays(room, scene.sent, scene.indirect, {}, {});
    return mirror.draw({frame, camera, nullptr}, rays, room, photo, scale, result);
  }
  /// Calls visit(pixel, F, light that it shows) for those that show the floor.
  template <class Visit>
  void each_of_floor(const Composite& result, const Visit& visit) const {
    for (std::size_t i = 0; i < photo.texels.size(); ++i)
      if (const float f = shown(i).share; f > 0.0f)
        visit(i, f, result.picture.texels[i]);
  }
};

bool same_bits(const RgbImage& a, const RgbImage& b) {
  return std::memcmp(a.texels.data(), b.texels.data(), a.texels.size() * sizeof(Rgb)) == 0;
}
void expect_near(const Rgb& shown, const Rgb& expected, std::size_t pixel) {
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(shown[c], expected[c], 1e-3f) << "pixel " << pixel << ", " << c;
}

TEST(RoomMirror, a_shadow_takes_nothing_of_what_the_floor_mirrors_of_the_room) {
  GlossyFloor floor;
  floor.cast_shadow();
  const Composite shadowed = floor.composite;
  EXPECT_EQ(floor.draw(floor.composite), 0u) << "pixels that changed before count there";
  int count = 0;
  floor.each_of_floor(floor.composite, [&](std::size_t i, float f, const Rgb& shown) {
    if (!floor.misses(i))
      return;
    expect_near(shown, kShadow * diffuse(i) + f * floor.before(), i);
    expect_near(shown - shadowed.picture.texels[i], (1.0f - kShadow) * f * floor.before(), i);
    ++count;
  });
  EXPECT_GT(count, 1000);
}

TEST(RoomMirror, where_nothing_is_shadowed_only_pixels_that_mirror_an_object_change) {
  GlossyFloor floor;
  const std::size_t changed = floor.draw(floor.composite);
  std::size_t count = 0, met = 0;
  for (std::size_t i = 0; i < floor.photo.texels.size(); ++i) {
    const bool floor_shown = floor.shown(i).share > 0.0f;
    if (!floor_shown || floor.misses(i)) {
      EXPECT_EQ(floor.composite.picture.texels[i], floor.photo.texels[i]) << i;
      EXPECT_EQ(floor.composite.touched[i], 0) << i;
    } else if (floor.meets(i))
      ++met;
    count += floor.composite.touched[i] == 1;
  }
  EXPECT_EQ(changed, count);
  EXPECT_GE(count, met);
  EXPECT_GT(met, 30u);
}

TEST(RoomMirror, of_a_black_object_in_its_shadow_leaves_the_shadowed_diffuse_part) {
  GlossyFloor floor;
  floor.cast_shadow();
  floor.draw(floor.composite);
  int met = 0;
  floor.each_of_floor(floor.composite, [&](std::size_t i, float f, const Rgb& shown) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_GE(shown[c], kShadow[c] * (floor.photo.texels[i][c] - f * floor.before()[c]) - 1e-3f) << i;
      EXPECT_GT(shown[c], 0.0f) << i;
    }
    if (!floor.meets(i))
      return;
    expect_near(shown, kShadow * diffuse(i), i);
    ++met;
  });
  EXPECT_GT(met, 30);
}

TEST(RoomMirror, an_object_that_sends_light_adds_its_image_to_the_shadowed_diffuse_part) {
  GlossyFloor floor;
  floor.cast_shadow();
  floor.send(3.0f);
  floor.draw(floor.composite);
  int met = 0;
  floor.each_of_floor(floor.composite, [&](std::size_t i, float f, const Rgb& shown) {
    const Rgb image = Rgb(3.0f / static_cast<float>(Surrounded::kRadiance)) * floor.before();
    if (floor.meets(i) && ++met)
      expect_near(shown, kShadow * diffuse(i) + f * image, i);
  });
  EXPECT_GT(met, 30);
}

TEST(RoomMirror, the_border_of_a_shadow_does_not_show_in_what_is_mirrored) {
  GlossyFloor floor;
  floor.cast_shadow(23, 41);
  floor.draw(floor.composite);
  floor.each_of_floor(floor.composite, [&](std::size_t i, float f, const Rgb& shown) {
    const int x = static_cast<int>(i % kWidth);
    if (floor.misses(i))
      expect_near(shown, (x >= 23 && x < 41 ? kShadow : Rgb(1.0f)) * diffuse(i) + f * floor.before(), i);
  });
}

TEST(RoomMirror, pixels_that_an_object_covers_change_as_far_as_they_show_the_floor) {
  GlossyFloor floor;
  floor.cast_shadow();
  const auto covered = [](std::size_t i) { return i % kWidth % 16 == 5 ? 0.25f : i % kWidth % 16 == 9 ? 1.0f : 0.0f; };
  for (std::size_t i = 0; i < floor.photo.texels.size(); ++i)
    if (covered(i) > 0.0f) {
      floor.composite.coverage[i] = covered(i);
      floor.composite.touched[i] = 2;
      floor.composite.picture.texels[i] = Rgb(7.0f);
    }
  floor.draw(floor.composite);
  floor.each_of_floor(floor.composite, [&](std::size_t i, float f, const Rgb& shown) {
    if (covered(i) == 1.0f) {
      EXPECT_EQ(shown, Rgb(7.0f)) << i;
    } else if (covered(i) > 0.0f && floor.misses(i))
      expect_near(shown, Rgb(7.0f) + 0.75f * (1.0f - kShadow) * f * floor.before(), i);
    if (covered(i) > 0.0f) {
      EXPECT_EQ(floor.composite.touched[i], 2) << i;
    }
  });
}

/// Floor and walls mirror each other as the photograph shows them.
TEST(RoomMirror, mirrors_the_picture_without_images_whatever_the_number_of_threads) {
  GlossyFloor floor(true);
  floor.cast_shadow(10, 50);
  std::optional<RgbImage> first;
  for (std::size_t run = 0; run < 40; ++run) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, run == 0 ? 1 : 1 + run % 8);
    Composite result = floor.composite;
    floor.draw(result, true);
    EXPECT_FALSE(same_bits(result.picture, floor.composite.picture));
    if (!first)
      first = result.picture;
    ASSERT_TRUE(same_bits(result.picture, *first)) << run;
  }
}

/// The slow twin: the images of one row at a time, each in a picture without any.
TEST(RoomMirror, no_row_sees_the_images_of_another) {
  GlossyFloor floor(true);
  floor.cast_shadow(10, 50);
  Composite all = floor.composite;
  floor.draw(all, true);
  for (int y = 0; y < kHeight; y += 6) {
    Composite one = floor.composite;
    const std::size_t begin = static_cast<std::size_t>(y) * kWidth;
    std::ranges::fill(one.touched, 0);
    std::fill_n(one.touched.begin() + static_cast<std::ptrdiff_t>(begin), kWidth, 1);
    floor.draw(one, true);
    EXPECT_EQ(std::memcmp(&one.picture.texels[begin], &all.picture.texels[begin], kWidth * sizeof(Rgb)), 0) << y;
  }
}

/// The photograph shows V (D + F L) at the camera's angle; a ray from elsewhere is to find V D + F' L.
TEST(RoomMirror, rays_of_objects_find_what_the_floor_mirrors_at_their_own_angle) {
  GlossyFloor floor;
  const Rgb d(0.15f);
  for (const Rgb& left : {Rgb(1.0f), kShadow}) {
    for (std::size_t i = 0; i < floor.photo.texels.size(); ++i) {
      const float f = floor.shown(i).share;
      floor.photo.texels[i] = f > 0.0f ? d + f * floor.before() : floor.before();
      floor.composite.picture.texels[i] = (f > 0.0f ? left : Rgb(1.0f)) * floor.photo.texels[i];
    }
    const PhotoPixels pixels(floor.photo);
    const PhotographedRoom photograph(floor.composite, floor.camera, floor.lens, floor.scale, 100.0f, &pixels);
    RoomSeen room = *floor.scene.seen;
    room.photograph = &photograph;
    room.gloss = floor.mirror.gloss();
    const GlossyRays rays(room, floor.scene.sent, floor.scene.indirect, {}, {});
    for (const std::size_t i : {25u * kWidth + 9u, 30u * kWidth + 12u, 38u * kWidth + 50u}) {
      const WorldRay camera = GlossyFloor::ray(floor.camera, i);
      const glm::dvec3 x =
          camera.origin - camera.origin.z / static_cast<double>(camera.direction.z) * glm::dvec3(camera.direction);
      for (const glm::dvec3& aside : {glm::dvec3(0.0, 0.1, 0.8), glm::dvec3(0.2, 0.5, 0.3)}) {
        const WorldRay ray{x + aside, glm::vec3(glm::normalize(-aside))};
        Rgb found;
        rays.radiance({&ray, 1}, {&found, 1});
        const float f = fresnel_dielectric(-ray.direction.z, ior_of(kReflectance));
        expect_near(floor.scale.apply(found), left * d + f * floor.before(), i);
      }
    }
  }
}

} // namespace
} // namespace daylit
