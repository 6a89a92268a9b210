#pragma once

#include "scene/image/rgb_image.h"

namespace daylit {

/// Light at a point of the room without the objects, for the ratio and the difference.
struct RoomPoint {
  Rgb indirect_irradiance{0.0f};
  Rgb open_sky_irradiance{0.0f};   ///< unshadowed, through the apertures
  Rgb sun_normal_irradiance{0.0f}; ///< of the sun as it arrives through its pane
  Rgb reflectance{0.5f};
};

} // namespace daylit
