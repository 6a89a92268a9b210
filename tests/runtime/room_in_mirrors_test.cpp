// The light of the room where mirrors show it and the photograph does not.

#include <gtest/gtest.h>

#include "surrounded.h"

namespace daylit {
namespace {

using test::Surrounded;

/// Greatest error of the room's light as mirrors show it, of places on a surface that looks up at a window, in parts.
double worst_beside_window(Surrounded& s, double from_y, double to_y) {
  s.place({2.0, 1.5, 1.0}, 0.0f);
  double worst = 0.0;
  for (double y = from_y; y < to_y; y += 0.0131) {
    const glm::dvec3 x(2.03, y, 0.9);
    RayHit hit;
    if (!s.rays.closest(s.rays.to_local(x + glm::dvec3(0.0, 0.0, 0.05)), {0.0f, 0.0f, -1.0f}, 0.0f, 0.1f, hit))
      continue;
    const RoomPoint at = s.room_light.evaluate(hit.triangle, x, {0, 0, -1});
    const double exact = static_cast<double>(at.indirect_irradiance.g + at.open_sky_irradiance.g),
                 kept = static_cast<double>(s.change.irradiance_without_sun(hit.triangle, x, {0, 0, -1}).before.g);
    worst = std::max(worst, std::fabs(kept / exact - 1.0));
  }
  return worst;
}

TEST(RoomInMirrors, on_a_board_below_a_window_the_light_is_as_it_is_there) {
  // 30 cm deep: cells as wide as far from an object would mix in points outside, which no probe lights.
  Surrounded s(0.15f, test::box_window(), 3.0f);
  test::add_block(s.volume.room, {1.2, 4.7, 0.86}, {2.8, 4.999, 0.9}, 0);
  s.rays = *RayScene::build(s.volume.room);
  s.volume.apertures = test::box_window();
  s.sampler = *LightFieldSampler::make(s.volume);
  s.room_light = RoomLight(s.volume.room, s.rays, s.sampler);
  s.room_light.set_frame(s.field, s.pyramid, s.cells, {});
  s.change = IndirectShadow(s.volume.room, s.rays, test::box_window(), s.room_light);
  EXPECT_LT(worst_beside_window(s, 4.72, 4.98), 0.01);
}

} // namespace
} // namespace daylit
