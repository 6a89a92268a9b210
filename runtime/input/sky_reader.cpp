#include "runtime/input/sky_reader.h"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include "scene/core/read_file.h"
#include "scene/core/text_lines.h"
#include "scene/sky/sun_position.h"

namespace daylit {

namespace {

constexpr float kSaturated = 0.98f;         ///< of the largest code: radiance is only known from below
constexpr std::uint64_t kCyclesToLearn = 8; ///< without a sky: the exposures cannot be told apart
constexpr auto kOldestReading = std::chrono::minutes(2);

/// Where the sun stands at a UTC time, x east, y north.
glm::dvec3 sun_at(const SkyPlace& place, std::int64_t time_ns) {
  using namespace std::chrono;
  const sys_time<nanoseconds> time{nanoseconds(time_ns)};
  const auto day = floor<days>(time);
  const year_month_day date(day);
  const LocalTime utc{int(date.year()), int(unsigned(date.month())), int(unsigned(date.day())),
                      duration<double, std::ratio<3600>>(time - day).count()};
  return sun_position({place.latitude_deg, place.longitude_deg, 0.0}, utc).direction;
}

} // namespace

Result<SkyReader> SkyReader::open(const SkyConfig& config) {
  const std::string name = config.projection == "fisheye" ? "fisheye:" + config.lens.string() : config.projection;
  const auto projection = parse_projection(name, config.rotation, {1.0, 0.0, 0.0}, {0.0, 0.0, 1.0});
  if (!projection)
    return projection.error();
  const auto fall_off = config.fall_off.empty() ? Result<FallOff>(FallOff{}) : read_fall_off(config.fall_off);
  if (!fall_off)
    return fall_off.error();
  const auto response = ResponseCurve::named(config.response);
  if (!response)
    return response.error();
  return SkyReader(config, *projection, *fall_off, *response);
}

/// What all frames of this size have in common.
Result<void> SkyReader::prepare(int width_px, int height_px) {
  const auto geometry = SkyGeometry::make(width_px, height_px, projection_, "sky camera");
  if (!geometry)
    return geometry.error();
  if (const auto* fisheye = std::get_if<FisheyeProjection>(&projection_); fisheye && !config_.fall_off.empty()) {
    auto sensitivity = pixel_sensitivity(fisheye->lens, fall_off_, width_px, height_px);
    if (!sensitivity)
      return sensitivity.error();
    sensitivity_ = std::move(*sensitivity);
  }
  geometry_ = *geometry;
  return {};
}

Result<SkyReader::Exposed> SkyReader::one_exposure(const CameraFrame& frame) const {
  auto code = linear_picture(frame);
  if (!code)
    return code.error();
  Exposed out{std::move(*code), {}};
  out.over_range.resize(out.radiance.texels.size());
  const auto per_ms = static_cast<float>(config_.white * (frame.exposure_us > 0 ? 1e3 / frame.exposure_us : 1.0));
  for (std::size_t i = 0; i < out.over_range.size(); ++i) {
    Rgb& texel = out.radiance.texels[i];
    out.over_range[i] = std::max({texel.r, texel.g, texel.b}) >= kSaturated;
    for (int c = 0; c < 3; ++c)
      texel[c] = per_ms * response_.exposure(texel[c], c);
  }
  return out;
}

Result<std::optional<SkyReader::Exposed>> SkyReader::bracket(const CameraFrame& frame) {
  auto code = linear_picture(frame);
  if (!code)
    return code.error();
  std::vector<double> times_ms;
  for (const int us : config_.exposures_us)
    times_ms.push_back(1e-3 * us);
  if (!cycle_) {
    auto made = BracketCycle::create(times_ms, {response_, usual_noise(frame.format.bits), kSaturated});
    if (!made)
      return made.error();
    cycle_.emplace(std::move(*made));
  }
  const auto stated = frame.exposure_us > 0 ? std::optional(1e-3 * frame.exposure_us) : std::nullopt;
  const auto time = cycle_->add(std::move(*code), frame.time_ns, stated);
  if (!time) {
    cycle_.reset();
    return time.error();
  }
  auto merged = *time == *std::ranges::min_element(times_ms) ? cycle_->merged() : std::nullopt;
  frames_without_sky_ = merged ? 0 : frames_without_sky_ + 1;
  if (frames_without_sky_ > kCyclesToLearn * times_ms.size())
    return Error{ErrorCode::value_invalid, "which exposure a frame has cannot be told: all of them look alike",
                 "[sky] exposures_us", "give exposures of which one at least is neither black nor white"};
  if (!merged)
    return std::optional<Exposed>();
  for (Rgb& texel : merged->bracket.radiance.texels)
    texel *= static_cast<float>(config_.white);
  return std::optional(Exposed{std::move(merged->bracket.radiance), std::move(merged->bracket.over_range_mask)});
}

/// As given, or the first number of the file. Errors: there is none, or it is old.
Result<double> SkyReader::reading() const {
  const std::string file = config_.illuminance_file.string();
  if (file.empty())
    return *config_.illuminance;
  const auto error = [&](const char* what) { return Error{ErrorCode::value_invalid, what, file, ""}; };
  const auto bytes = read_whole_file(config_.illuminance_file, 4096);
  if (!bytes)
    return bytes.error();
  std::error_code failed;
  const auto written = std::filesystem::last_write_time(config_.illuminance_file, failed);
  if (failed || std::filesystem::file_time_type::clock::now() - written > kOldestReading)
    return error("is older than two minutes");
  const std::string text(bytes->begin(), bytes->end());
  const auto number = parse_number(trimmed(std::string_view(text).substr(0, text.find_first_of("\r\n"))));
  if (!number || !(*number >= 0 && *number < 1e12))
    return error("holds no number in its first line");
  return *number;
}

Result<MeasuredSky> SkyReader::measured(Exposed exposed, std::int64_t time_ns) const {
  SkyBalance balance;
  balance.over_range = static_cast<std::uint64_t>(std::ranges::count(exposed.over_range, std::uint8_t{1}));
  if (balance.over_range > 0) {
    const auto expected = config_.place ? std::optional(sun_at(*config_.place, time_ns)) : std::nullopt;
    const auto sun = lost_sun(*geometry_, exposed.over_range, expected);
    balance.sun_lost = sun.has_value();
    balance.unexplained = balance.over_range - (sun ? sun->pixels : 0);
    if (sun && (config_.illuminance || !config_.illuminance_file.empty())) {
      const auto read = reading();
      if (read)
        balance.sun_restored = restore_sun(exposed.radiance, *geometry_, sun->direction, *read);
      else
        balance.no_reading = read.error().message();
    }
  }
  auto sky = SkyImage::make(std::move(exposed.radiance), geometry_, config_.ground, "sky camera");
  if (!sky)
    return sky.error();
  balance.irradiance = horizontal_irradiance(*sky);
  return MeasuredSky{std::move(*sky), balance};
}

Result<std::optional<MeasuredSky>> SkyReader::read(const CameraFrame& frame) {
  auto exposed = std::optional<Exposed>();
  if (is_bracket()) {
    auto made = bracket(frame);
    if (!made)
      return made.error();
    exposed = std::move(*made);
  } else {
    auto made = one_exposure(frame);
    if (!made)
      return made.error();
    exposed = std::move(*made);
  }
  if (!exposed)
    return std::optional<MeasuredSky>();
  if (!geometry_)
    if (const Result<void> good = prepare(exposed->radiance.width, exposed->radiance.height); !good)
      return good.error();
  if (!sensitivity_.empty())
    divide(exposed->radiance, sensitivity_);
  auto sky = measured(std::move(*exposed), frame.time_ns);
  if (!sky)
    return sky.error();
  return std::optional(std::move(*sky));
}

} // namespace daylit
