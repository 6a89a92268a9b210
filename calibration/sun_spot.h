#pragma once

// The sun in a fish-eye picture.

#include <optional>
#include <string>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/image/rgb_image.h"
#include "scene/lens/lens.h"

namespace daylit::calibration {

struct SunSpot {
  glm::dvec3 direction{0.0}; ///< unit, camera frame
  glm::dvec2 px{0.0};
  double radius_deg = 0.0; ///< root mean square distance of its light from its middle
};

/// The brightest spot inside the lens's field, where it is small and stands out. `saturated`: value from which a pixel
/// is clipped; infinite for an HDR picture. Nothing, and `why`: there is none.
std::optional<SunSpot> find_sun(const RgbImage& picture, const LensModel& lens, float saturated, std::string& why);

/// Light of the spot: its radiance above that of the ring around it, times solid angle.
double spot_light(const RgbImage& picture, const LensModel& lens, const SunSpot& spot);

} // namespace daylit::calibration
