// A lamp in a closed room that is grey everywhere: what it sends is absorbed by the walls, and by nothing else.

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
  /// Mean of the irradiance over all faces of the box.
  double mean_irradiance() const {
    constexpr int kSide = 16;
    const Bounds box = volume.room.bounds();
    double power = 0.0, area = 0.0;
    for (int face = 0; face < 6; ++face) {
      const int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
      const double each = box.size()[u] * box.size()[v] / (kSide * kSide);
      for (int k = 0; k < kSide * kSide; ++k) {
        glm::dvec3 x = box.min, out(0.0);
        x[axis] = face % 2 ? box.max[axis] : box.min[axis];
        x[u] += (k % kSide + 0.5) / kSide * box.size()[u];
        x[v] += (k / kSide + 0.5) / kSide * box.size()[v];
        out[axis] = face % 2 ? 1.0 : -1.0;
        RayHit hit;
        EXPECT_TRUE(rays.closest(rays.to_local(x - 0.1 * out), glm::vec3(out), 0.0f, 1.0f, hit));
        power += each * static_cast<double>(change.at(hit.triangle, x, out).irradiance.g);
        area += each;
      }
    }
    return power / area;
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
      EXPECT_NEAR(room.mean_irradiance() / expected, 1.0, 0.03) << rho << " at " << at.x;
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

} // namespace
} // namespace daylit
