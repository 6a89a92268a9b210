#pragma once

// A sky in words: the [sky] section of a SCENE.toml, or a file that holds nothing else.
//
//   model = "uniform" | "overcast" | "clear"     zenith_radiance, or diffuse_horizontal (irradiance without the sun)
//   model = "cie"      cie_type = 1..15          zenith_radiance or diffuse_horizontal; a sun where the type has one
//   model = "perez"    direct_normal_solar, diffuse_horizontal_solar (broadband W/m2), dew_point (C); sun position
//   model = "weather"  file = "x.epw" | "x.wea", time
//   model = "general"  distribution = [a, b, c, d, e, base] (scene/sky/sky_distribution.h)
//   sun = { azimuth (degrees counter-clockwise from +x), elevation, or direction; diameter (degrees),
//           normal_irradiance }
//   place = { latitude, longitude (east), time_zone (hours) }, time = "2021-06-21 12:30" (local standard time):
//           where the sun stands, instead of its direction; +x is east, +y north
//   rotation (degrees): turns the whole sky counter-clockwise about z
//   ground_albedo or ground_radiance
//   sky_colour, sun_colour: of perez and weather; scaled to luminance 1
// Perez and weather skies are luminance / kLumensPerWatt in W m^-2 sr^-1, equal channels unless coloured.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "scene/core/result.h"
#include "scene/sky/perez_sky.h"
#include "scene/sky/sky_model.h"
#include "scene/sky/weather_file.h"

namespace daylit {

/// Luminance per radiance of skies without a photometric unit, lm/W: Radiance's convention (Ward 1994).
constexpr double kLumensPerWatt = 179.0;

struct SkyDescription {
  SkyModel model;
  std::vector<std::string> notes; ///< for people: the weather row used, limits overstepped
};

struct SkyColours {
  Rgb sky{1.0f}, sun{1.0f}; ///< scaled to luminance 1
};

/// The direct light of a sun whose disc is not wholly above the horizon is left out, with a note; `disc` gives its
/// size.
SkyDescription perez_description(const PerezSky& perez, const SunPosition& sun, const SkyColours& colours = {},
                                 const SunDisc& disc = {});

/// The Perez sky of a row of a tape, sun in the middle of its interval. A night is black.
Result<SkyDescription> weather_sky(const WeatherFile& weather, const WeatherRow& row, const SkyColours& colours = {});

/// The [sky] section of a TOML file; other sections are not looked at.
Result<SkyDescription> read_sky_description(const std::filesystem::path& path);
/// The same from memory; `path` is in errors, and weather tapes are looked for beside it.
Result<SkyDescription> parse_sky_description(std::string_view text, const std::filesystem::path& path);

/// The sky turned counter-clockwise about z, radians.
SkyModel rotated(SkyModel sky, double angle);

} // namespace daylit
