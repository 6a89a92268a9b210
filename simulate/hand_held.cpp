// daylit-simulate hand-held.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>

#include "scene/core/atomic_file.h"
#include "scene/core/parallel.h"
#include "scene/core/program.h"
#include "scene/lens/lens.h"
#include "scene/lens/orientation.h"
#include "scene/sky/sky_image.h"
#include "simulate/photograph_command.h"
#include "simulate/sensor_picture.h"

namespace daylit {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kGoldenAngle = 2.399963229728653;
constexpr int kAcross = 256, kDown = 192; ///< rays of the exposure meter
constexpr double kMean[] = {0.12, 0.03};  ///< of full scale: what a camera makes of a picture's mean; two stops darker
constexpr double kHighlight = 0.9;        ///< of full scale: what it makes of the brightest place
constexpr double kShake_deg = 4.0;        ///< deviation of the directions from an even spread
constexpr double kRoll_deg = 8.0;

struct HandHeld {
  glm::dmat3 world_from_camera{1.0}, rough{1.0};
  double exposure = 1.0, stated = 1.0;
};

glm::dmat3 turn(double angle, const glm::dvec3& axis) { return glm::dmat3(glm::rotate(glm::dmat4(1.0), angle, axis)); }

/// A spiral on the sphere with equal areas between its points (Gonzalez 2010), and what a hand adds.
std::vector<HandHeld> plan(const HandHeldArguments& a) {
  std::mt19937 random(a.seed);
  std::normal_distribution<double> normal;
  std::vector<HandHeld> all;
  for (int i = 0; i < a.pictures; ++i) {
    const double lowest = std::sin(a.lowest_deg * kDegree), z = 1.0 - (1.0 - lowest) * (i + 0.5) / a.pictures;
    HandHeld h;
    h.world_from_camera = camera_orientation(kGoldenAngle * i + kShake_deg * kDegree * normal(random), std::asin(z),
                                             kRoll_deg * kDegree * normal(random));
    const glm::dvec3 axis = glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
    h.rough = turn(a.off_deg * kDegree, axis) * h.world_from_camera;
    all.push_back(h);
  }
  return all;
}

/// Radiance between the four nearest texels.
Rgb bilinear(const SkyImage& sky, const glm::dvec3& direction) {
  const RgbImage& image = sky.image();
  const glm::dvec2 p = sky.pixel(direction).value_or(glm::dvec2(0.0));
  const double x0 = std::floor(p.x), y0 = std::floor(p.y);
  const auto texel = [&](double x, double y) {
    const int column = (static_cast<int>(x) % image.width + image.width) % image.width;
    return image.at(column, std::clamp(static_cast<int>(y), 0, image.height - 1));
  };
  const auto u = static_cast<float>(p.x - x0), v = static_cast<float>(p.y - y0);
  return (1 - v) * ((1 - u) * texel(x0, y0) + u * texel(x0 + 1, y0)) +
         v * ((1 - u) * texel(x0, y0 + 1) + u * texel(x0 + 1, y0 + 1));
}

RgbImage seen(const SkyImage& sky, const LensModel& lens, const HandHeld& h) {
  RgbImage light(lens.width_px, lens.height_px);
  parallel_for(0, light.height, [&](int y) {
    for (int x = 0; x < light.width; ++x) {
      Rgb sum(0.0f);
      for (const glm::dvec2& at : {glm::dvec2(-0.25, -0.25), {0.25, -0.25}, {-0.25, 0.25}, {0.25, 0.25}})
        if (const auto d = lens.unproject(glm::dvec2(x, y) + at))
          sum += bilinear(sky, h.world_from_camera * *d);
      light.at(x, y) = sum * static_cast<float>(0.25 * h.exposure);
    }
  });
  return light;
}

/// exposure x radiance = code. Every other picture is held dark enough for its highlights, the others are metered by
/// their mean or two stops darker; the camera's range ends `stops` below the longest exposure.
void meter(std::vector<HandHeld>& all, const SkyImage& sky, const LensModel& lens, const HandHeldArguments& a) {
  double longest = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    double mean = 0, brightest = 0;
    for (int k = 0; k < kAcross * kDown; ++k) {
      const glm::dvec2 at((k % kAcross + 0.5) / kAcross * lens.width_px, (k / kAcross + 0.5) / kDown * lens.height_px);
      const Rgb light =
          bilinear(sky, all[i].world_from_camera * lens.unproject(at - 0.5).value_or(glm::dvec3(0, 0, 1)));
      mean += static_cast<double>(luminance(light)) / (kAcross * kDown);
      brightest = std::max(brightest, static_cast<double>(std::max({light.r, light.g, light.b})));
    }
    all[i].stated = i % 2 == 1 ? std::min(kHighlight / brightest, kMean[0] / mean) : kMean[i / 2 % 2] / mean;
    longest = std::max(longest, all[i].stated);
  }
  std::mt19937 random(a.seed + 1);
  std::normal_distribution<double> normal;
  for (HandHeld& h : all) {
    h.stated = std::max(h.stated, longest * std::exp2(-a.stops));
    h.exposure = h.stated * std::exp(a.exposure_error * normal(random));
  }
}

/// azimuth, altitude, roll as in camera_orientation(), degrees.
std::string angles(const glm::dmat3& m) {
  const glm::dvec3 f = m[2];
  const double azimuth = std::atan2(f.y, f.x), altitude = std::asin(std::clamp(f.z, -1.0, 1.0));
  const glm::dmat3 level = camera_orientation(azimuth, altitude, 0.0);
  const double roll = std::atan2(glm::dot(m[0], level[1]), glm::dot(m[0], level[0]));
  return fmt::format("{:.4f} {:.4f} {:.4f}", azimuth / kDegree, altitude / kDegree, roll / kDegree);
}

} // namespace

Result<void> run_hand_held(const HandHeldArguments& a) {
  const auto sky = read_sky(a.map, EquirectProjection{});
  if (!sky)
    return sky.error();
  std::error_code failed;
  std::filesystem::create_directories(a.folder, failed);
  const LensModel lens = ideal_pinhole(a.size[0], a.size[1], a.fov_deg * kDegree);
  const std::string heading = "# picture  exposure  azimuth altitude roll (degrees)";
  std::string list = heading + ", as a phone would tell\n", truth = heading + ", as it was\n";
  ProgressLine progress(a.quiet || a.json);
  std::vector<HandHeld> all = plan(a);
  meter(all, *sky, lens, a);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!progress.update("pictures", static_cast<double>(i) / a.pictures))
      return interrupted_error("hand-held");
    RgbImage light = seen(*sky, lens, all[i]);
    add_noise(light, {0.0, a.noise * a.noise, 0.0}, a.seed + static_cast<std::uint32_t>(i));
    const std::string name = fmt::format("{:03}.png", i);
    if (const Result<void> written = write_camera_file(a.folder / name, light, PictureFormat::png); !written)
      return written;
    list += fmt::format("{} {:.6g} {}\n", name, all[i].stated, angles(all[i].rough));
    truth += fmt::format("{} {:.6g} {}\n", name, all[i].exposure, angles(all[i].world_from_camera));
  }
  for (const auto& [name, text] : {std::pair{"list.txt", list}, {"truth.txt", truth}})
    if (const Result<void> written = write_file_atomically(a.folder / name, text); !written)
      return written;
  return write_lens(a.folder / "lens.yaml", lens);
}

} // namespace daylit
