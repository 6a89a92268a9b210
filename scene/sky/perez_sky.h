#pragma once

// The all-weather sky: from the direct and diffuse irradiance of a weather tape to a luminance distribution and its
// scale. Perez, Ineichen, Seals, Michalsky, Stewart, "Modeling daylight availability and irradiance components from
// direct and global irradiance", Solar Energy 44 (1990), here [1990]; Perez, Seals, Michalsky, "All-weather model for
// sky luminance distribution", Solar Energy 50 (1993) with its erratum 51 (1993), here [1993].

#include <string>
#include <vector>

#include "scene/core/result.h"
#include "scene/sky/sky_distribution.h"

namespace daylit {

/// Broadband quantities. The sun may be below the horizon: its zenith angle then counts as a right angle.
struct PerezWeather {
  double direct_normal_W_m2 = 0.0, diffuse_horizontal_W_m2 = 0.0;
  double sun_altitude = 0.0; ///< radians
  double sun_distance_au = 1.0;
  double dew_point_C = kUsualDewPoint_C; ///< sets the water vapour in the luminous efficacies

  static constexpr double kUsualDewPoint_C = 11.0;
};

struct PerezSky {
  double clearness = 1.0, brightness = 0.0;                       ///< epsilon and Delta, [1990] eq. 1 and 2
  SkyDistribution distribution;                                   ///< [1993] eq. 1, 6, 7, 8
  double direct_efficacy_lm_W = 0.0, diffuse_efficacy_lm_W = 0.0; ///< [1990] eq. 7, 8
  double direct_normal_lx = 0.0, diffuse_horizontal_lx = 0.0;
  std::vector<std::string> notes; ///< limits that the weather overstepped
};

/// The limits of the published fits are kept: clearness 1..12, brightness 0.01..0.6, and at least 0.2 in the shape for
/// clearness 1.065..2.8 (as the authors' own program does). Error: a value is negative or not finite, more than 2000
/// W/m2, or there is no diffuse light.
Result<PerezSky> perez_sky(const PerezWeather& weather);

/// The irradiances whose perez_sky() has these illuminances (lx): efficacies depend on the result, so they are iterated
/// to 1e-9. Error: they do not settle, or as above.
Result<PerezWeather> weather_from_illuminance(double direct_normal_lx, double diffuse_horizontal_lx,
                                              PerezWeather weather);

} // namespace daylit
