#include "scene/sky/sky.h"

#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "scene/core/parallel.h"
#include "scene/sky/sky_description.h"

namespace daylit {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kRasterHeight = 512;
constexpr int kSubTexels = 2;
constexpr int kSunPoints = 4096;

std::optional<SunDisc> lit_sun(const AnalyticSky& sky) {
  const std::optional<SunDisc>& sun = sky.model().sun;
  return sun && sun->normal_irradiance != Rgb(0.0f) ? sun : std::nullopt;
}

/// Mean of the radiance over a texel: midpoints in azimuth and in the cosine of the zenith angle, where the solid angle
/// is even. The horizon is a border of texels.
Rgb texel_mean(const AnalyticSky& sky, int x, int y, int height) {
  const double top = std::cos(kPi * y / height), bottom = std::cos(kPi * (y + 1) / height);
  glm::dvec3 sum(0.0);
  for (int j = 0; j < kSubTexels; ++j)
    for (int i = 0; i < kSubTexels; ++i) {
      const double z = top + (bottom - top) * (j + 0.5) / kSubTexels, across = std::sqrt(1.0 - z * z);
      const double azimuth = 2.0 * kPi * (0.5 - (x + (i + 0.5) / kSubTexels) / (2 * height));
      sum += glm::dvec3(sky.sky_radiance({across * std::cos(azimuth), across * std::sin(azimuth), z}));
    }
  return Rgb(sum / static_cast<double>(kSubTexels * kSubTexels));
}

Result<OpenedSky> open_picture(const SkyArguments& a) {
  if (!a.time.empty())
    return Error{ErrorCode::usage, "a sky picture has no hours to choose from", "--time", "leave it out"};
  const auto axis = [](const std::vector<double>& given, const glm::dvec3& otherwise) {
    return given.empty() ? otherwise : glm::dvec3(given[0], given[1], given[2]);
  };
  const auto projection =
      parse_projection(a.projection, a.rotation_deg * kPi / 180.0, axis(a.forward, {1, 0, 0}), axis(a.up, {0, 0, 1}));
  if (!projection)
    return projection.error();
  GroundFill ground;
  if (a.ground_albedo)
    ground = {GroundFill::Kind::albedo, static_cast<float>(*a.ground_albedo)};
  std::vector<std::string> notes;
  auto image = read_sky(a.file, *projection, ground, &notes);
  if (!image)
    return image.error();
  return OpenedSky{Sky(*std::move(image)), std::move(notes)};
}

Result<SkyDescription> open_tape(const SkyArguments& a) {
  const auto time = parse_local_time(a.time);
  if (!time)
    return a.time.empty() ? Error{ErrorCode::usage, "a weather tape needs a time", a.file.string(),
                                  "add --time \"06-21 12:30\", local standard time"}
                          : time.error();
  const auto weather = read_weather(a.file);
  if (!weather)
    return weather.error();
  const auto row = weather_at(*weather, *time);
  if (!row)
    return row.error();
  return weather_sky(*weather, *row);
}

} // namespace

Sky::Sky(SkyImage image) : image_(std::make_shared<const SkyImage>(std::move(image))) {}

/// A sun of a description is kept apart from the sky: its disc is smaller than a texel.
Sky::Sky(const SkyModel& model) : described_(AnalyticSky(model)), sun_(lit_sun(*described_)) {}

Rgb Sky::radiance(const glm::dvec3& d) const { return described_ ? described_->sky_radiance(d) : image_->radiance(d); }

/// Texel means of the sky without its sun; the sun is added to the regions exactly.
SkyImage sky_raster(const AnalyticSky& sky, int height) {
  RgbImage image(2 * height, height);
  parallel_for(0, height, [&](int y) {
    for (int x = 0; x < 2 * height; ++x)
      image.at(x, y) = texel_mean(sky, x, y, height);
  });
  return *SkyImage::make(std::move(image), EquirectProjection{}); // finite, not negative
}

/// Even over the disc: equal areas in radius, the golden angle pi (3 - sqrt 5) around (Vogel 1979).
std::vector<glm::dvec3> disc_points(const SunDisc& sun, int count) {
  const glm::dvec3 other_axis = std::abs(sun.direction.z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
  const glm::dvec3 t = glm::normalize(glm::cross(other_axis, sun.direction)), b = glm::cross(sun.direction, t);
  std::vector<glm::dvec3> points;
  points.reserve(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) {
    // The chord to a point of the cap: equal chord^2 is equal area.
    const double chord = 2.0 * std::sin(0.5 * sun.angular_radius) * std::sqrt((k + 0.5) / count);
    const double angle = k * kPi * (3.0 - std::sqrt(5.0)), sine = chord * std::sqrt(1.0 - 0.25 * chord * chord);
    points.push_back((1.0 - 0.5 * chord * chord) * sun.direction + sine * (std::cos(angle) * t + std::sin(angle) * b));
  }
  return points;
}

std::vector<Rgb> region_radiance(const Sky& sky, const SkyPartition& partition) {
  if (sky.image())
    return region_radiance(*sky.image(), partition);
  std::vector<Rgb> mean = region_radiance(sky_raster(*sky.described(), kRasterHeight), partition);
  if (!sky.sun())
    return mean;
  // A sun adds its radiance times the fraction of its solid angle in the region, over the solid angle of the region.
  std::vector<double> fraction(mean.size(), 0.0);
  for (const glm::dvec3& d : disc_points(*sky.sun(), kSunPoints))
    if (partition.interpolated())
      for (const RegionWeight& w : partition.interpolation(d))
        fraction[static_cast<std::size_t>(w.region)] += w.weight / kSunPoints;
    else
      fraction[static_cast<std::size_t>(partition.region_of(d))] += 1.0 / kSunPoints;
  for (std::size_t i = 0; i < mean.size(); ++i)
    if (fraction[i] > 0.0)
      mean[i] += sky.sun()->radiance() * static_cast<float>(fraction[i] * sky.sun()->solid_angle_sr() /
                                                            partition.solid_angle_sr(static_cast<int>(i)));
  return mean;
}

/// By extension: .toml a sky in words, .epw and .wea a weather tape, else a picture of the sky.
Result<OpenedSky> open_sky(const SkyArguments& a) {
  const std::string kind = a.file.extension().string();
  const bool tape = kind == ".epw" || kind == ".wea";
  if (a.projection != "angular" && !(a.forward.empty() && a.up.empty()))
    return Error{ErrorCode::usage, "only an angular map has axes to choose",
                 a.forward.empty() ? "--sky-up" : "--forward", "leave it out, or add --projection angular"};
  if (!tape && kind != ".toml")
    return open_picture(a);
  if (a.projection != "equirect")
    return Error{ErrorCode::usage, "only a sky picture has a projection", "--projection", "leave it out"};
  if (!tape && !a.time.empty())
    return Error{ErrorCode::usage, "the time of a described sky stands in its file", "--time", "leave it out"};
  auto description = tape ? open_tape(a) : read_sky_description(a.file);
  if (!description)
    return description.error();
  if (a.ground_albedo)
    description->model.ground_albedo = static_cast<float>(*a.ground_albedo);
  return OpenedSky{Sky(rotated(description->model, a.rotation_deg * kPi / 180.0)), std::move(description->notes)};
}

} // namespace daylit
