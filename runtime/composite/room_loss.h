#pragma once

#include <algorithm>
#include <numbers>

#include <glm/common.hpp>

#include "runtime/composite/compose.h"
#include "runtime/composite/drawn_picture.h"

namespace daylit {

/// Irradiance of the room at a pixel: without the objects, and what they take (negative: give).
struct RoomLoss {
  Rgb before{0.0f}, lost{0.0f};
};

/// E = E_open sky x received + E_sun x received + E_indirect and what the objects take of it; the drawn values hold the
/// fractions times the part of the pixel that shows the room.
inline RoomLoss direct_loss(const DrawnPixel& drawn, const RoomPoint& point) {
  const float whole = 1.0f / drawn.lost_sky.w;
  const Rgb lost_sky = whole * Rgb(drawn.lost_sky);
  const glm::vec3 received = whole * glm::vec3(drawn.room);
  return {point.open_sky_irradiance * received.x + point.sun_normal_irradiance * received.y + point.indirect_irradiance,
          point.open_sky_irradiance * lost_sky + point.sun_normal_irradiance * received.z};
}

/// The light between two points of a plane.
inline void mix(const RoomPoint& a, const RoomPoint& b, float t, RoomPoint& between) {
  between.indirect_irradiance = a.indirect_irradiance + t * (b.indirect_irradiance - a.indirect_irradiance);
  between.open_sky_irradiance = a.open_sky_irradiance + t * (b.open_sky_irradiance - a.open_sky_irradiance);
}

inline bool casts_shadow(const DrawnPixel& pixel) {
  return pixel.lost_sky.w > 0.0f &&
         std::max({pixel.lost_sky.x, pixel.lost_sky.y, pixel.lost_sky.z, pixel.room.z}) > 0.0f;
}

/// The photograph's pixel after that: photo x (E - lost) / E, or photo - scale rho/pi lost (Debevec 1998; Gibson &
/// Murta 2000).
inline Rgb changed(const Rgb& photo, const RoomLoss& loss, const Rgb& reflectance, const ComposeSettings& settings) {
  if (settings.mode == ShadowMode::difference) {
    const Rgb change = reflectance * loss.lost * std::numbers::inv_pi_v<float>;
    return glm::max(photo - settings.photo.apply(change), Rgb(0.0f));
  }
  Rgb ratio(1.0f);
  for (int c = 0; c < 3; ++c)
    if (loss.before[c] > 0.0f)
      ratio[c] = std::max(1.0f - loss.lost[c] / loss.before[c], 0.0f);
  return photo * ratio;
}

} // namespace daylit
