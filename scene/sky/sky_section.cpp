#include "scene/sky/sky_section.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "scene/format/toml_text.h"

namespace daylit::detail {

namespace {

constexpr double kRadians = std::numbers::pi / 180.0, kMaxRadiance = 1e12;

/// One [sky] section while it is read.
class SkyReader {
public:
  explicit SkyReader(TomlSection& sky) : sky_(sky) {}
  void read(SkyDescription& out);

private:
  std::optional<LocalTime> read_time();
  void read_place();
  bool read_direction(TomlSection& section, SunDisc& disc);
  void read_sun(SkyModel& model, bool needs_irradiance);
  void read_scale(SkyModel& model);
  void read_distribution(SkyModel& model);
  void read_ground(SkyModel& model);
  SkyColours read_colours();
  void read_analytic(const std::string& kind, SkyModel& model);
  void read_perez(SkyDescription& out);
  void read_weather(SkyDescription& out);

  TomlSection& sky_;
  std::optional<SunPosition> placed_; ///< from place and time
};

std::optional<LocalTime> SkyReader::read_time() {
  std::string text;
  if (!sky_.read("time", text))
    return std::nullopt;
  const Result<LocalTime> time = parse_local_time(text);
  if (time)
    return *time;
  sky_.problem("time", time.error().what + "; " + time.error().hint);
  return std::nullopt;
}

void SkyReader::read_place() {
  const bool has_time = sky_.has("time");
  const std::optional<LocalTime> time = read_time();
  TomlSection section = sky_.section("place");
  if (!section) {
    if (has_time)
      sky_.problem("time", "needs place = { latitude, longitude, time_zone }");
    return;
  }
  Place place;
  const bool north = section.read("latitude", place.latitude_deg, {-90, 90});
  const bool east = section.read("longitude", place.longitude_deg, {-180, 180});
  const bool zone = section.read("time_zone", place.time_zone_h, {-15, 15});
  section.finish();
  if (!north || !east || !zone)
    section.problem("", "needs latitude, longitude (degrees, east positive) and time_zone (hours, east positive)");
  else if (time)
    placed_ = sun_position(place, *time);
  if (!has_time)
    sky_.problem("place", "needs time = \"2021-06-21 12:30\"");
}

/// Azimuth from +x counter-clockwise, elevation from the horizon, degrees; or a direction of any length.
/// True when the section says where the sun is.
bool SkyReader::read_direction(TomlSection& section, SunDisc& disc) {
  double azimuth = 0.0, elevation = 45.0;
  glm::dvec3 direction(0.0);
  const bool turned = section.read("azimuth", azimuth, {-720.0, 720.0});
  const bool high = section.read("elevation", elevation, {0.0, 90.0});
  if (section.read("direction", direction, {-1e9, 1e9})) {
    if (turned || high)
      section.problem("direction", "given together with azimuth or elevation; keep one");
    if (!(glm::length(direction) > 1e-6))
      section.problem("direction", "has no length");
    else
      disc.direction = glm::normalize(direction);
    return true;
  }
  if (placed_ && !turned && !high)
    return false;
  const double a = azimuth * kRadians, e = elevation * kRadians;
  disc.direction = {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
  return turned || high;
}

/// A disc of the given diameter (degrees); the irradiance on a surface that faces it is in radiance unit times sr.
void SkyReader::read_sun(SkyModel& model, bool needs_irradiance) {
  TomlSection section = sky_.section("sun");
  if (!section && !placed_)
    return;
  SunDisc disc;
  double diameter = disc.angular_radius * 2.0 / kRadians;
  const bool own_direction = section && read_direction(section, disc);
  if (placed_ && own_direction)
    section.problem("", "has a direction, and the sky a place and a time; keep one");
  if (placed_)
    disc.direction = placed_->direction;
  if (section && section.read("diameter", diameter, {0.01, 30.0}))
    disc.angular_radius = 0.5 * diameter * kRadians;
  if (section && needs_irradiance &&
      !section.read_rgb("normal_irradiance", disc.normal_irradiance, {0.0, kMaxRadiance}) &&
      !section.has("normal_irradiance"))
    section.problem("", "needs normal_irradiance");
  const double altitude = std::asin(std::clamp(disc.direction.z, -1.0, 1.0));
  if (needs_irradiance && (altitude < 0.0 || (altitude < disc.angular_radius && disc.normal_irradiance != Rgb(0.0f))))
    (section ? section : sky_)
        .problem("", placed_ ? "the sun is on or below the horizon at that time"
                             : "the sun touches the horizon; raise its elevation");
  if (section)
    section.finish();
  model.sun = disc;
}

/// One of two scales: radiance of the zenith, or irradiance of the horizontal by the sky alone.
void SkyReader::read_scale(SkyModel& model) {
  const bool zenith = sky_.read_rgb("zenith_radiance", model.zenith_radiance, {0.0, kMaxRadiance});
  Rgb diffuse(0.0f);
  if (!sky_.read_rgb("diffuse_horizontal", diffuse, {0.0, kMaxRadiance}))
    return;
  model.diffuse_horizontal = diffuse;
  if (zenith)
    sky_.problem("diffuse_horizontal", "given together with zenith_radiance; keep one");
}

/// Ground below the horizon: radiance, or albedo times irradiance of the horizontal over pi.
void SkyReader::read_ground(SkyModel& model) {
  const bool albedo = sky_.read("ground_albedo", model.ground_albedo, {0.0, 1.0});
  if (sky_.read_rgb("ground_radiance", model.ground_radiance, {0.0, kMaxRadiance})) {
    if (albedo)
      sky_.problem("ground_radiance", "given together with ground_albedo; keep one");
    model.ground_albedo = -1.0f;
  }
}

SkyColours SkyReader::read_colours() {
  SkyColours colours;
  for (const auto& [key, colour] : {std::pair("sky_colour", &colours.sky), std::pair("sun_colour", &colours.sun)})
    if (sky_.read_rgb(key, *colour, {0.0, 1e6}) && !(luminance(*colour) > 0.0f)) {
      sky_.problem(key, "is black; black skies have no irradiance");
      *colour = Rgb(1.0f);
    }
  return colours;
}

/// Parameters of gradation and indicatrix (SkyDistribution); base 1 for Perez.
void SkyReader::read_distribution(SkyModel& model) {
  SkyDistribution& s = model.distribution;
  std::array<double, 6> value{};
  if (sky_.read_array("distribution", value, {-1e6, 1e6}))
    s = {value[0], value[1], value[2], value[3], value[4], value[5]};
  else if (!sky_.has("distribution"))
    sky_.problem("model", "a general sky needs distribution = [a, b, c, d, e, base]");
}

void SkyReader::read_analytic(const std::string& kind, SkyModel& model) {
  read_place();
  read_sun(model, true);
  read_scale(model);
  model.kind = kind == "uniform"    ? SkyModel::Kind::uniform
               : kind == "overcast" ? SkyModel::Kind::overcast
               : kind == "clear"    ? SkyModel::Kind::clear
                                    : SkyModel::Kind::general;
  if (kind == "clear" && !model.sun)
    sky_.problem("model", "a clear sky needs sun = { azimuth, elevation, normal_irradiance }");
  int type = 0;
  if (kind == "cie" && !sky_.read("cie_type", type, {1, 15}) && !sky_.has("cie_type"))
    sky_.problem("model", "a CIE sky needs cie_type, 1 to 15");
  if (kind == "cie" && type > 0)
    model.distribution = *cie_sky(type);
  if (kind == "general")
    read_distribution(model);
  if (model.kind != SkyModel::Kind::general)
    return;
  if (model.distribution.depends_on_sun() && !model.sun)
    sky_.problem("model", "this sky is shaped by the sun: give sun = { ... }, or place and time");
  else if (!(model.distribution.horizontal_integral(model.sun ? model.sun->direction.z : 1.0) > 0.0) ||
           (!model.diffuse_horizontal &&
            !(model.distribution.relative({0, 0, 1}, model.sun ? model.sun->direction : glm::dvec3(0, 0, 1)) > 0.0)))
    sky_.problem("model", "this distribution is black");
}

/// W/m^2 on the plane facing the sun and on the horizontal, without the sun; dew point in degrees Celsius.
void SkyReader::read_perez(SkyDescription& out) {
  PerezWeather weather;
  read_place();
  SkyModel with_sun;
  read_sun(with_sun, false);
  const bool direct = sky_.read("direct_normal_solar", weather.direct_normal_W_m2, {0.0, 2000.0});
  const bool diffuse = sky_.read("diffuse_horizontal_solar", weather.diffuse_horizontal_W_m2, {1e-3, 2000.0});
  sky_.read("dew_point", weather.dew_point_C, {-100.0, 100.0});
  const SkyColours colours = read_colours();
  if (!with_sun.sun)
    sky_.problem("model", "a Perez sky needs place and time, or sun = { azimuth, elevation }");
  if ((!direct && !sky_.has("direct_normal_solar")) || (!diffuse && !sky_.has("diffuse_horizontal_solar")))
    sky_.problem("model", "a Perez sky needs direct_normal_solar and diffuse_horizontal_solar (W/m2)");
  if (!with_sun.sun || !direct || !diffuse)
    return;
  SunPosition sun = placed_.value_or(SunPosition{});
  sun.direction = with_sun.sun->direction;
  sun.altitude = std::asin(std::clamp(sun.direction.z, -1.0, 1.0));
  weather.sun_altitude = sun.altitude;
  weather.sun_distance_au = sun.distance;
  const Result<PerezSky> perez = perez_sky(weather);
  if (!perez)
    sky_.problem("model", perez.error().what);
  else
    out = perez_description(*perez, sun, colours, *with_sun.sun);
}

/// The row of the tape at that time, through the Perez model.
void SkyReader::read_weather(SkyDescription& out) {
  std::filesystem::path path;
  const bool file = sky_.read("file", path);
  const std::optional<LocalTime> time = read_time();
  const SkyColours colours = read_colours();
  if (!file || !sky_.has("time")) {
    sky_.problem("model", "a weather sky needs file = \"x.epw\" or \"x.wea\", and time = \"06-21 12:30\"");
    return;
  }
  if (!time)
    return;
  const Result<WeatherFile> weather = daylit::read_weather(path);
  const Result<WeatherRow> row = weather ? weather_at(*weather, *time) : Result<WeatherRow>(weather.error());
  const Result<SkyDescription> sky = row ? weather_sky(*weather, *row, colours) : Result<SkyDescription>(row.error());
  if (sky)
    out = *sky;
  else
    sky_.problem("file", sky.error().message());
}

void SkyReader::read(SkyDescription& out) {
  std::string kind = "overcast";
  sky_.read_word("model", kind, {"uniform", "overcast", "clear", "cie", "general", "perez", "weather"});
  if (kind == "perez")
    read_perez(out);
  else if (kind == "weather")
    read_weather(out);
  else
    read_analytic(kind, out.model);
  read_ground(out.model);
  double rotation = 0.0;
  if (sky_.read("rotation", rotation, {-720.0, 720.0}))
    out.model = rotated(out.model, rotation * kRadians);
  sky_.finish();
}

} // namespace

void read_sky_section(TomlSection sky, SkyDescription& description) { SkyReader(sky).read(description); }

/// Reads back as the same model: angles in degrees, directions as vectors.
std::string sky_toml(const SkyModel& sky) {
  static constexpr const char* kKind[] = {"uniform", "overcast", "clear", "general"};
  std::string out = fmt::format("[sky]\nmodel = \"{}\"\n", kKind[static_cast<int>(sky.kind)]);
  if (sky.kind == SkyModel::Kind::general) {
    const SkyDistribution& s = sky.distribution;
    out += fmt::format("distribution = [{}, {}, {}, {}, {}, {}]\n", text(s.a), text(s.b), text(s.c), text(s.d),
                       text(s.e), text(s.base));
  }
  out += sky.diffuse_horizontal ? fmt::format("diffuse_horizontal = {}\n", text(*sky.diffuse_horizontal))
                                : fmt::format("zenith_radiance = {}\n", text(sky.zenith_radiance));
  out += sky.ground_albedo >= 0.0f ? fmt::format("ground_albedo = {}\n", sky.ground_albedo)
                                   : fmt::format("ground_radiance = {}\n", text(sky.ground_radiance));
  if (sky.sun)
    out += fmt::format("sun = {{ direction = {}, diameter = {}, normal_irradiance = {} }}\n", text(sky.sun->direction),
                       text(sky.sun->angular_radius * 2.0 / kRadians), text(sky.sun->normal_irradiance));
  return out;
}

} // namespace daylit::detail
