// A lamp in a closed room that is grey everywhere: what it sends is absorbed by the walls, and by nothing else. And a
// black ball, which takes its light from all of them.

#include <gtest/gtest.h>

#include "runtime/indirect/indirect_shadow.h"
#include "surrounded.h"

namespace daylit {
namespace {

using test::kPi;
using test::Surrounded;

constexpr float kRadius = 0.1f, kReflectance = 0.6f, kSent = 10.0f;

/// A room without any other light, with a sphere that shines.
struct LampRoom : Surrounded {
  explicit LampRoom(const glm::dvec3& at, float reflectance = kReflectance) : Surrounded(kRadius) {
    set_walls(reflectance);
    field.probe.assign(volume.probes.size(), Sh9Rgb{});
    room_light.set_frame(field, pyramid, cells, {});
    place(at, kSent);
    ObjectSurface lamp = test::place(mesh, at);
    lamp.emission.assign(mesh.positions.size(), Rgb(kSent));
    change.set_lamps(lamp);
    change.set_indirect(std::vector<TwoSided>(mesh.positions.size()));
  }
  /// Power of the sphere, pi L A, over the area of the room.
  double sent_per_area() const {
    const glm::dvec3 s = volume.room.bounds().size();
    return kPi * static_cast<double>(kSent) * 4.0 * kPi * static_cast<double>(kRadius * kRadius) /
           (2.0 * (s.x * s.y + s.y * s.z + s.z * s.x));
  }
};

/// With reflectance rho the walls receive Phi (1 + rho + rho^2 + ...) = Phi / (1 - rho) in all. Far away the lamp is
/// seen by eight rays: 2 % too bright between black walls, too.
TEST(LampLight, the_walls_receive_what_the_lamp_sends_over_one_minus_their_reflectance) {
  for (const glm::dvec3& at : {glm::dvec3(2.0, 2.5, 1.2), glm::dvec3(0.4, 0.5, 0.3)})
    for (const float rho : {0.0f, kReflectance}) {
      const LampRoom room(at, rho);
      const double expected = room.sent_per_area() / (1.0 - static_cast<double>(rho));
      EXPECT_NEAR(room.mean_change() / expected, 1.0, 0.03) << rho << " at " << at.x;
    }
}

/// E = pi F L, F = (r / h)^2 (Howell B-4): below the lamp most of the light is straight, and black walls add nothing.
TEST(LampLight, below_a_lamp_between_black_walls_the_floor_receives_its_form_factor) {
  const double height = 0.5, f = static_cast<double>(kRadius * kRadius) / (height * height);
  const LampRoom room({2.0, 2.5, height}, 0.0f);
  const auto received = static_cast<double>(room.at({2.0, 2.5, 0.0}).irradiance.g);
  EXPECT_NEAR(received / (kPi * f * static_cast<double>(kSent)), 1.0, 0.03);
}

/// In the middle of bright walls the radiance that arrives is about rho / pi of their mean irradiance.
TEST(LampLight, an_object_receives_what_the_walls_reflect_of_the_lamp) {
  constexpr float kBright = 0.9f;
  const LampRoom room({2.0, 2.5, 1.2}, kBright);
  const double wall = room.sent_per_area() / (1.0 - static_cast<double>(kBright)),
               expected = static_cast<double>(kBright) * wall / kPi;
  const Sh9Rgb light = room.change.lamp_light(0, {2.0, 2.5, 1.2});
  EXPECT_NEAR(static_cast<double>(light[0].g) / (2.0 * std::sqrt(kPi)) / expected, 1.0, 0.06);
}

TEST(LampLight, an_object_without_emission_is_no_lamp) {
  LampRoom room({2.0, 2.5, 1.2});
  EXPECT_TRUE(room.change.affects({0.1, 0.1, 0.0}));
  room.change.set_lamps(test::place(room.mesh, {2.0, 2.5, 1.2}));
  EXPECT_FALSE(room.change.has_lamps());
  EXPECT_FALSE(room.change.affects({0.1, 0.1, 0.0}));
}

/// A black ball in a grey room that sends the same light from everywhere, half of it reflected: of what it takes,
/// A_ball rho E, the walls lack 1 + rho + rho^2 + ...
TEST(DimmedRoom, all_walls_lack_what_a_black_ball_takes_over_one_minus_their_reflectance) {
  constexpr double kLarge = 0.5, kGrey = 0.5;
  Surrounded room(static_cast<float>(kLarge), test::box_window());
  room.set_walls(static_cast<float>(kGrey));
  room.place({2.0, 2.5, 1.2}, 0.0f);
  ASSERT_TRUE(room.change.dims_room());
  const glm::dvec3 s = room.volume.room.bounds().size();
  const double taken = 4.0 * kPi * kLarge * kLarge * kGrey * kPi * Surrounded::kRadiance,
               expected = -taken / (2.0 * (s.x * s.y + s.y * s.z + s.z * s.x)) / (1.0 - kGrey);
  EXPECT_NEAR(room.mean_change() / expected, 1.0 - kGrey, 0.03) << "straight";
  room.change.find_dimming();
  room.change.set_indirect(std::vector<TwoSided>(room.mesh.positions.size()));
  EXPECT_NEAR(room.mean_change() / expected, 0.9, 0.1); // window and ball take 8 % of what goes on
}

TEST(DimmedRoom, a_small_object_dims_it_only_before_the_window) {
  const std::vector<Aperture> window = test::box_window();
  Surrounded room(kRadius, window);
  room.place({2.0, 0.5, 0.3}, 0.0f);
  EXPECT_FALSE(room.change.dims_room());
  glm::dvec3 middle(0.0);
  for (const glm::dvec3& c : window[0].corners)
    middle += 0.25 * c;
  room.place(middle + 0.11 * window[0].inward, 0.0f);
  EXPECT_TRUE(room.change.dims_room());
}

} // namespace
} // namespace daylit
