#include "calibration/sun_spot.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

namespace daylit::calibration {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kReach_deg = 6.0;   ///< around the brightest pixel: what may belong to the sun
constexpr float kHalf = 0.4f;        ///< of the brightest value: counts as the sun
constexpr double kLargest_deg = 2.5; ///< rms radius of a sun with its glare
constexpr float kStandsOut = 8.0f;   ///< brightest value over the median, of an HDR picture
constexpr double kElsewhere = 0.3;   ///< of the bright light may lie apart from the spot

struct Seen {
  glm::dvec3 direction;
  double solid_angle;
  float value;
};

float peak_of(const RgbImage& picture, const LensModel& lens, glm::ivec2& at) {
  float peak = 0.0f;
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x)
      if (const float v = luminance(picture.at(x, y)); v > peak && lens.covers({x, y})) {
        peak = v;
        at = {x, y};
      }
  return peak;
}

float median_of(const RgbImage& picture, const LensModel& lens) {
  std::vector<float> values;
  const int step = std::max(1, picture.width / 256);
  for (int y = 0; y < picture.height; y += step)
    for (int x = 0; x < picture.width; x += step)
      if (lens.covers({x, y}))
        values.push_back(luminance(picture.at(x, y)));
  if (values.empty())
    return 0.0f;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// All pixels that are nearly as bright as the brightest.
std::vector<Seen> bright_pixels(const RgbImage& picture, const LensModel& lens, float from) {
  std::vector<Seen> bright;
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x)
      if (const float v = luminance(picture.at(x, y)); v >= from)
        if (const auto d = lens.unproject({x, y}))
          bright.push_back({*d, lens.solid_angle_density({x, y}), v});
  return bright;
}

} // namespace

// The middle is the mean direction, weighted by light above a tenth of the peak: a sun between two pixels is brighter
// in the nearer one in proportion (area coverage).
std::optional<SunSpot> find_sun(const RgbImage& picture, const LensModel& lens, float saturated, std::string& why) {
  glm::ivec2 at{0};
  const float peak = peak_of(picture, lens, at);
  const auto start = lens.unproject(at);
  const bool clipped = peak >= saturated;
  if (!(peak > 0.0f) || !start) {
    why = "the picture is black";
    return std::nullopt;
  }
  if (std::isfinite(saturated) ? !clipped : peak < kStandsOut * median_of(picture, lens)) {
    why = "no sun: nothing in the sky is much brighter than the rest";
    return std::nullopt;
  }
  const double cosine = std::cos(kReach_deg * kDegree);
  double near = 0, all = 0;
  for (const Seen& s : bright_pixels(picture, lens, clipped ? saturated : kHalf * peak)) {
    all += s.solid_angle;
    near += glm::dot(s.direction, *start) > cosine ? s.solid_angle : 0.0;
  }
  if (all - near > kElsewhere * all) {
    why = "no sun: several parts of the sky are as bright, clouds or reflections";
    return std::nullopt;
  }
  glm::dvec3 sum(0.0);
  double weight = 0;
  const std::vector<Seen> spot = bright_pixels(picture, lens, clipped ? saturated : 0.1f * peak);
  for (const Seen& s : spot)
    if (glm::dot(s.direction, *start) > cosine) {
      const double w = s.solid_angle * (clipped ? 1.0 : static_cast<double>(s.value));
      sum += w * s.direction;
      weight += w;
    }
  SunSpot sun{glm::normalize(sum), lens.project(sum).value_or(glm::dvec2(at)), 0.0};
  double square = 0;
  for (const Seen& s : spot)
    if (glm::dot(s.direction, *start) > cosine)
      square += s.solid_angle * (clipped ? 1.0 : static_cast<double>(s.value)) *
                std::pow(glm::length(s.direction - sun.direction) / kDegree, 2);
  sun.radius_deg = std::sqrt(square / weight);
  if (sun.radius_deg > kLargest_deg) {
    why = fmt::format("no sun: the brightest spot is {:.0f} degrees wide, a cloud before the sun or glare",
                      2 * sun.radius_deg);
    return std::nullopt;
  }
  return sun;
}

// The ring is as far from the spot as the reach of its light, and half as wide.
double spot_light(const RgbImage& picture, const LensModel& lens, const SunSpot& spot) {
  double inside = 0, around = 0, inside_angle = 0, around_angle = 0;
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const auto d = lens.unproject({x, y});
      if (!d || glm::dot(*d, spot.direction) < std::cos(1.5 * kReach_deg * kDegree))
        continue;
      const double w = lens.solid_angle_density({x, y}), light = w * static_cast<double>(luminance(picture.at(x, y)));
      const bool in = glm::dot(*d, spot.direction) > std::cos(kReach_deg * kDegree);
      (in ? inside : around) += light;
      (in ? inside_angle : around_angle) += w;
    }
  return inside - (around_angle > 0 ? inside_angle * around / around_angle : 0.0);
}

} // namespace daylit::calibration
