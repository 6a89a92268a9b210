#include "bench/reference_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "precompute/held_out.h"
#include "precompute/probes.h"
#include "scene/volume/indirect_light.h"

namespace daylit::bench {

namespace {

constexpr double kRadians = std::numbers::pi / 180;
constexpr double kClearance = 0.05;
constexpr double kSunBesideNormal_deg = 20, kHighSun_deg = 45, kLowSun_deg = 12;

/// Azimuth towards which the largest opening that is no skylight looks out.
double facing(const std::vector<Aperture>& apertures) {
  double best = -1, azimuth = 0;
  for (const Aperture& a : apertures) {
    glm::dvec3 area{0.0};
    for (std::size_t k = 1; k + 1 < a.corners.size(); ++k)
      area += glm::cross(a.corners[k] - a.corners[0], a.corners[k + 1] - a.corners[0]);
    const double upright = glm::length(area) * std::hypot(a.inward.x, a.inward.y);
    if (upright > best) {
      best = upright;
      azimuth = std::atan2(-a.inward.y, -a.inward.x);
    }
  }
  return azimuth;
}

SunDisc sun_at(double azimuth, double elevation, const Rgb& normal_irradiance) {
  SunDisc sun;
  sun.direction = {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                   std::sin(elevation)};
  sun.normal_irradiance = normal_irradiance;
  return sun;
}

BenchSky described(const std::string& name, bool small_sun, const SkyModel& model) {
  return {name, small_sun, Sky(model), SkyLight(model)};
}

BenchSky painted(const std::string& name, SkyImage picture) {
  const auto image = std::make_shared<const SkyImage>(std::move(picture));
  SkyLight light(image);
  return {name, light.has_spots(), Sky(*image), light};
}

/// Linear in the direction, in another way for each channel.
Result<SkyImage> gradient() {
  RgbImage image(512, 256);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const double theta = std::numbers::pi * (y + 0.5) / image.height;
      const double phi = 2 * std::numbers::pi * (0.5 - (x + 0.5) / image.width);
      const glm::dvec3 d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
      image.at(x, y) = Rgb(1.0 + 0.9 * d);
    }
  return SkyImage::make(std::move(image), EquirectProjection{}, {}, "gradient");
}

struct Ratio {
  double error2 = 0, power2 = 0;
  void add(const Rgb& difference, const Rgb& truth) {
    error2 += glm::dot(glm::dvec3(difference), glm::dvec3(difference));
    power2 += glm::dot(glm::dvec3(truth), glm::dvec3(truth));
  }
  double nrms() const { return power2 > 0 ? std::sqrt(error2 / power2) : 0.0; }
};

glm::dvec3 axis(std::size_t k) {
  glm::dvec3 n(0.0);
  n[static_cast<int>(k / 2)] = k % 2 == 0 ? 1.0 : -1.0;
  return n;
}

/// What coefficients of the reference leave of its irradiance, without the noise of either.
double coefficients_leave(const ReferenceLight& reference, ShOrder order) {
  Ratio left, noise;
  for (std::size_t p = 0; p < reference.points.size(); ++p)
    for (std::size_t k = 0; k < 6; ++k) {
      const CoefficientEstimate& c = reference.coefficients[p];
      const IrradianceEstimate& e = reference.irradiance[6 * p + k];
      const glm::vec3 n(axis(k));
      const bool band4 = order == ShOrder::fourth;
      left.add(irradiance(ShRadiance{c.value, band4 ? c.band4 : Band4Rgb{}}, n) - e.value, e.value);
      noise.add(e.standard_error, e.value);
      for (std::size_t l = 0; l < 9; ++l) { // errors of the coefficients taken as independent
        ShRadiance one{}, four{};
        one.nine[l] = c.standard_error[l];
        four.band4[l] = c.band4_error[l];
        noise.add(irradiance(one, n), Rgb(0.0f));
        noise.add(band4 ? irradiance(four, n) : Rgb(0.0f), Rgb(0.0f));
      }
    }
  return std::sqrt(std::max(0.0, left.nrms() * left.nrms() - noise.nrms() * noise.nrms()));
}

} // namespace

Result<std::vector<BenchSky>> bench_skies(const std::vector<Aperture>& apertures,
                                          const std::vector<std::filesystem::path>& pictures) {
  const double azimuth = facing(apertures) + kSunBesideNormal_deg * kRadians;
  std::vector<BenchSky> skies;
  SkyModel model;
  model.kind = SkyModel::Kind::overcast;
  skies.push_back(described("overcast", false, model));
  auto colours = gradient();
  if (!colours)
    return colours.error();
  skies.push_back(painted("gradient", std::move(*colours)));
  model.kind = SkyModel::Kind::clear;
  model.diffuse_horizontal = Rgb(80.0f, 100.0f, 130.0f);
  model.sun = sun_at(azimuth, kHighSun_deg * kRadians, Rgb(700.0f, 660.0f, 600.0f));
  skies.push_back(described("clear, sun at 45 degrees", true, model));
  model.diffuse_horizontal = Rgb(30.0f, 40.0f, 60.0f);
  model.sun = sun_at(azimuth, kLowSun_deg * kRadians, Rgb(500.0f, 400.0f, 280.0f));
  skies.push_back(described("clear, sun at 12 degrees", true, model));
  for (const std::filesystem::path& path : pictures) {
    auto picture = read_sky(path, EquirectProjection{});
    if (!picture)
      return picture.error();
    skies.push_back(painted(path.stem().string(), std::move(*picture)));
  }
  return skies;
}

Result<std::vector<glm::dvec3>> reference_points(const Room& room, const std::vector<Aperture>& apertures,
                                                 std::size_t count) {
  const auto rays = RayScene::build(room);
  if (!rays)
    return rays.error();
  const Bounds bounds = room.bounds();
  const glm::dvec3 size = bounds.size();
  const auto candidates =
      precompute::spread_points(room, bounds, 2 * count, kClearance * std::max({size.x, size.y, size.z}));
  const auto probes = precompute::make_points(candidates, bounds, *rays, apertures);
  if (!probes)
    return probes.error();
  std::vector<glm::dvec3> points;
  for (std::size_t i = 0; i < candidates.size() && points.size() < count; ++i)
    if (probes->valid[i])
      points.push_back(candidates[i]);
  return points;
}

Result<ReferenceLight> trace_reference(const Room& room, const std::vector<Aperture>& apertures, const BenchSky& sky,
                                       const std::vector<glm::dvec3>& points, int samples, const Progress& progress) {
  const auto scene = TraceScene::make(room, apertures, sky.light);
  if (!scene)
    return scene.error();
  std::vector<Receiver> places, faces;
  for (const glm::dvec3& p : points) {
    places.push_back({p, axis(0)});
    for (std::size_t k = 0; k < 6; ++k)
      faces.push_back({p, axis(k)});
  }
  auto coefficients = trace_coefficients(*scene, places, {.samples = samples}, progress);
  if (!coefficients)
    return coefficients.error();
  auto received = trace_irradiance(*scene, faces, {.samples = samples}, progress);
  if (!received)
    return received.error();
  return ReferenceLight{points, std::move(*coefficients), std::move(*received)};
}

Result<LightError> light_error(const BasisVolume& volume, const BenchSky& sky, const ReferenceLight& reference) {
  const auto scene = rays_of_light(volume);
  if (!scene)
    return scene.error();
  const auto indirect = IndirectLight::make(volume, *scene, sky.sky);
  if (!indirect)
    return indirect.error();
  Ratio coefficients, received, coefficient_noise, received_noise;
  for (std::size_t p = 0; p < reference.points.size(); ++p) {
    const auto got = indirect->at(reference.points[p]);
    if (!got) {
      const glm::dvec3& at = reference.points[p];
      return Error{ErrorCode::not_found, "the volume knows no light at a reference point",
                   std::to_string(at.x) + " " + std::to_string(at.y) + " " + std::to_string(at.z), ""};
    }
    const CoefficientEstimate& truth = reference.coefficients[p];
    for (std::size_t l = 0; l < 9; ++l) {
      coefficients.add(got->nine[l] - truth.value[l], truth.value[l]);
      coefficient_noise.add(truth.standard_error[l], truth.value[l]);
    }
    for (std::size_t k = 0; k < 6; ++k) {
      const IrradianceEstimate& e = reference.irradiance[6 * p + k];
      const glm::vec3 n(axis(k));
      received.add(irradiance(*got, n) - e.value, e.value);
      received_noise.add(e.standard_error, e.value);
    }
  }
  const double noise = coefficient_noise.nrms();
  return LightError{std::sqrt(std::max(0.0, coefficients.nrms() * coefficients.nrms() - noise * noise)),
                    received.nrms(),
                    noise,
                    received_noise.nrms(),
                    coefficients_leave(reference, ShOrder::second),
                    coefficients_leave(reference, ShOrder::fourth)};
}

} // namespace daylit::bench
