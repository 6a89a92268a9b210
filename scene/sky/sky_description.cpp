#include "scene/sky/sky_description.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "scene/sky/sky_section.h"

namespace daylit {

namespace {

constexpr double kRadians = std::numbers::pi / 180.0;

/// The colour scaled to a luminance; all in the unit of `value`.
Rgb of_luminance(const Rgb& colour, double value) {
  return colour * static_cast<float>(value / static_cast<double>(luminance(colour)));
}

/// What the Perez model needs, in W/m^2: direct normal = direct horizontal / sin(altitude); illuminances are turned
/// back by the efficacies of the model itself.
Result<PerezWeather> weather_of(const WeatherFile& weather, const WeatherRow& row, const SunPosition& sun) {
  PerezWeather w;
  w.sun_altitude = sun.altitude;
  w.sun_distance_au = sun.distance;
  if (std::isfinite(row.dew_point_C))
    w.dew_point_C = row.dew_point_C;
  if (weather.unit == WeatherUnit::illuminance)
    return weather_from_illuminance(row.direct, row.diffuse, w);
  w.direct_normal_W_m2 = row.direct;
  w.diffuse_horizontal_W_m2 = row.diffuse;
  if (weather.unit == WeatherUnit::horizontal_irradiance)
    w.direct_normal_W_m2 = sun.altitude > 0.0 ? row.direct / std::sin(sun.altitude) : 0.0;
  return w;
}

} // namespace

/// Perez luminances as radiance: cd/m^2 over 179 lm/W. A sun that touches the horizon gives no direct light; it still
/// shapes the sky, from the horizon.
SkyDescription perez_description(const PerezSky& perez, const SunPosition& sun, const SkyColours& colours,
                                 const SunDisc& disc_of) {
  SkyDescription sky;
  sky.model.kind = SkyModel::Kind::general;
  sky.model.distribution = perez.distribution;
  // lx over 179 lm/W, the white efficacy of Radiance: radiance in its unit, W/(sr m^2).
  sky.model.diffuse_horizontal = of_luminance(colours.sky, perez.diffuse_horizontal_lx / kLumensPerWatt);
  SunDisc disc = disc_of;
  disc.direction = sun.direction;
  disc.normal_irradiance = of_luminance(colours.sun, perez.direct_normal_lx / kLumensPerWatt);
  if (sun.altitude < disc.angular_radius) {
    if (perez.direct_normal_lx > 0.0)
      sky.notes.push_back(fmt::format("the sun is on or below the horizon ({:.2f} degrees): {:.0f} lx of direct light "
                                      "are left out",
                                      sun.altitude / kRadians, perez.direct_normal_lx));
    disc.normal_irradiance = Rgb(0.0f);
    disc.direction.z = std::max(0.0, disc.direction.z); // it shapes the sky from the horizon
    disc.direction = glm::normalize(disc.direction);
  }
  sky.model.sun = disc;
  sky.notes.insert(sky.notes.end(), perez.notes.begin(), perez.notes.end());
  return sky;
}

/// Sun from place and time, luminances from the Perez model; a row of two zeros is night and a black sky.
Result<SkyDescription> weather_sky(const WeatherFile& weather, const WeatherRow& row, const SkyColours& colours) {
  const SunPosition sun = sun_position(weather.place, row.time);
  SkyDescription sky;
  sky.notes.push_back(fmt::format("{}, line {}: {} local standard time, sun {:.2f} degrees high, {:.2f} from north",
                                  weather.name, row.line, time_text(row.time), sun.altitude / kRadians,
                                  sun.azimuth / kRadians));
  if (row.direct == 0.0 && row.diffuse == 0.0) {
    sky.model.kind = SkyModel::Kind::uniform;
    sky.model.zenith_radiance = Rgb(0.0f);
    sky.notes.emplace_back("no daylight at that time: the sky is black");
    return sky;
  }
  const Result<PerezWeather> known = weather_of(weather, row, sun);
  const Result<PerezSky> perez = known ? perez_sky(*known) : Result<PerezSky>(known.error());
  if (!perez) {
    Error error = perez.error();
    error.where = fmt::format("{}, line {}", weather.name, row.line);
    return error;
  }
  if (!std::isfinite(row.dew_point_C))
    sky.notes.push_back(fmt::format("no dew point: {} C is used", PerezWeather::kUsualDewPoint_C));
  SkyDescription result = perez_description(*perez, sun, colours);
  result.notes.insert(result.notes.begin(), sky.notes.begin(), sky.notes.end());
  return result;
}

/// Turns the sun about +z, counter-clockwise as seen from above; radians. The rest of the sky follows the sun.
SkyModel rotated(SkyModel sky, double angle) {
  if (sky.sun && angle != 0.0) {
    const glm::dvec3 d = sky.sun->direction;
    const double c = std::cos(angle), s = std::sin(angle);
    sky.sun->direction = {c * d.x - s * d.y, s * d.x + c * d.y, d.z};
  }
  return sky;
}

namespace {

Result<SkyDescription> sky_of(Result<detail::ConfigFile> file) {
  if (!file)
    return file.error();
  SkyDescription description;
  detail::TomlSection root(*file, &file->root, "");
  if (detail::TomlSection sky = root.section("sky"))
    detail::read_sky_section(sky, description);
  else
    file->report(1, "section [sky] is missing");
  if (auto error = file->error())
    return *error;
  return description;
}

} // namespace

Result<SkyDescription> read_sky_description(const std::filesystem::path& path) {
  return sky_of(detail::parse_config_file(path));
}

Result<SkyDescription> parse_sky_description(std::string_view text, const std::filesystem::path& path) {
  return sky_of(detail::parse_config_text(text, path));
}

} // namespace daylit
