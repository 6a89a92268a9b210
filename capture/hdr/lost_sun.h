#pragma once

// A sun that is brighter than a camera can show, put back by an illuminance reading.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/sky/sky_image.h"

namespace daylit {

/// What is known about light that a picture of the sky does not hold.
struct SkyBalance {
  std::uint64_t over_range = 0;  ///< pixels brighter than the camera can show
  std::uint64_t unexplained = 0; ///< of them, those that are not the sun's: bright clouds, an exposure that is too long
  bool sun_lost = false;         ///< the sun is among them
  bool sun_restored = false;     ///< it was put back: the irradiance is that of the reading
  Rgb irradiance{0.0f};          ///< horizontal, of the sky as it is used; 0: not measured (the lens sees no horizon)
  std::string no_reading = {};   ///< why the sun was not put back, where a reading was announced
  /// What the horizontal irradiance may be at most. While only the sun is lost and was not put back `irradiance` holds
  /// all diffuse light, and under clear skies this is 0.165 of the whole at least (Erbs, Klein, Duffie 1982,
  /// k_t > 0.8). Nothing: other light is lost too, and nobody knows how much.
  std::optional<Rgb> irradiance_at_most() const;
};

struct LostSun {
  glm::dvec3 direction;
  std::uint64_t pixels = 0; ///< over range, within 4 degrees of it
};

/// The sun among pixels that are over range: at `expected` where one of these lies within 4 degrees of it; without it
/// in their middle, where all of them lie within 4 degrees of that. Nothing: they are something else.
std::optional<LostSun> lost_sun(const SkyGeometry& geometry, const std::vector<std::uint8_t>& over_range,
                                const std::optional<glm::dvec3>& expected);

/// Adds a sun of equal channels at `direction`, shared bilinearly among four pixels, so that the sky's horizontal
/// illuminance (luminance of its irradiance, radiance unit x sr) is `illuminance`. Adds nothing where it is that much
/// already. False: the direction lies outside the picture or below the horizon, or the projection is no fish-eye.
bool restore_sun(RgbImage& radiance, const SkyGeometry& geometry, const glm::dvec3& direction, double illuminance);

/// Of a fish-eye picture, the part of the upper hemisphere that it does not see filled with the mean of the rest; 0 of
/// others.
Rgb horizontal_irradiance(const SkyImage& sky);

} // namespace daylit
