#pragma once

// Looking at parts of the light one by one.

#include <numbers>
#include <span>

#include "runtime/picture/picture_renderer.h"
#include "runtime/session/session.h"

namespace daylit {

inline LightSet without_sun(LightSet lights) {
  lights.sun.clear();
  return lights;
}

inline void hide_parts(const ShownParts& shown, std::span<VertexLight> light) {
  for (VertexLight& v : light) {
    if (!shown.direct)
      v.open_sky_front = v.open_sky_back = Rgb(0.0f);
    if (!shown.indirect)
      v.indirect_front = v.indirect_back = Rgb(0.0f);
  }
}

/// Radiance of a point of the room under indirect light and the whole of its windows' sky.
inline Rgb reflected(const RoomPoint& point) {
  return point.reflectance * (point.indirect_irradiance + point.open_sky_irradiance) * std::numbers::inv_pi_v<float>;
}

} // namespace daylit
