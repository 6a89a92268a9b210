#include "calibration/material_checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include "scene/core/parallel.h"

namespace daylit::calibration {

namespace {

constexpr double kRadians = std::numbers::pi / 180.0;
constexpr std::size_t kPosePixels = 1500, kWindowPixels = 20000, kFewestWindow = 50;
constexpr double kTurn_deg = 0.7, kMoved_m = 0.05, kGain = 0.8;

glm::dmat4 moved(const glm::dmat4& pose, const std::array<double, 6>& by) {
  const glm::dvec3 turn(by[0], by[1], by[2]);
  const double angle = glm::length(turn);
  glm::dmat3 rotation(pose);
  if (angle > 0)
    rotation = rotation * glm::mat3_cast(glm::angleAxis(angle * kRadians, turn / angle));
  glm::dmat4 out(rotation);
  out[3] = pose[3] + glm::dvec4(by[3], by[4], by[5], 0.0);
  return out;
}

/// Radiance that the fit gives along a ray: B / pi of the patch that it meets, or the sky.
std::optional<Rgb> computed(const glm::dvec3& eye, const glm::dvec3& d, std::size_t sky, const RoomTransport& transport,
                            const MaterialFit& fit) {
  if (const auto at = transport.first_surface(eye, d)) {
    if (at->patch < 0)
      return std::nullopt;
    const float* b = fit.radiosity.row(static_cast<std::size_t>(at->patch));
    const std::size_t skies = transport.skies();
    return Rgb(b[sky], b[skies + sky], b[2 * skies + sky]) / std::numbers::pi_v<float>;
  }
  return transport.seen_sky(eye, d, sky);
}

/// Every n-th pixel that counts.
std::vector<std::uint32_t> spread_pixels(const MaterialView& view, std::size_t count) {
  std::vector<std::uint32_t> pixels;
  const std::size_t n = view.left_out.size(), step = std::max<std::size_t>(1, n / count) | 1u;
  for (std::size_t i = step / 2; i < n; i += step)
    if (view.left_out[i] != MaterialView::kMasked)
      pixels.push_back(static_cast<std::uint32_t>(i));
  return pixels;
}

glm::dvec2 position(const MaterialView& view, std::uint32_t index) {
  const auto width = static_cast<std::uint32_t>(view.radiance.width);
  return {index % width, index / width};
}

double disagreement(const MaterialView& view, const glm::dmat4& pose, const std::vector<std::uint32_t>& pixels,
                    const RoomTransport& transport, const MaterialFit& fit) {
  double sum = 0.0;
  for (const std::uint32_t i : pixels) {
    const auto d = view.lens.unproject(position(view, i));
    if (!d)
      continue;
    const auto light = computed(glm::dvec3(pose[3]), glm::normalize(glm::dmat3(pose) * *d), view.sky, transport, fit);
    const float measured = luminance(view.radiance.texels[i]);
    const double off = light && measured > 0 && luminance(*light) > 0
                           ? std::abs(std::log(static_cast<double>(measured / luminance(*light))))
                           : kMostOff;
    sum += std::min(off, kMostOff);
  }
  return sum / static_cast<double>(std::max<std::size_t>(pixels.size(), 1));
}

} // namespace

bool BetterPose::is_another() const { return (turn_deg > kTurn_deg || moved_m > kMoved_m) && after < kGain * before; }

BetterPose search_pose(const MaterialView& view, const RoomTransport& transport, const MaterialFit& fit) {
  const std::vector<std::uint32_t> pixels = spread_pixels(view, kPosePixels);
  const auto cost = [&](const std::array<double, 6>& by) {
    return disagreement(view, moved(view.world_from_camera, by), pixels, transport, fit);
  };
  std::array<double, 6> best{};
  BetterPose found;
  double least = found.before = cost(best);
  for (double turn = 4.0, shift = 0.2; turn > 0.2; turn *= 0.5, shift *= 0.5)
    for (bool better = true; better;) {
      better = false;
      std::array<std::pair<double, std::array<double, 6>>, 12> tries;
      parallel_for(std::size_t{0}, tries.size(), [&](std::size_t k) {
        std::array<double, 6> by = best;
        by[k / 2] += (k % 2 ? -1 : 1) * (k < 6 ? turn : shift);
        tries[k] = {cost(by), by};
      });
      const auto& [value, by] = *std::ranges::min_element(tries);
      if (value < 0.999 * least) {
        least = value, best = by;
        better = true;
      }
    }
  found.after = least;
  found.turn_deg = glm::length(glm::dvec3(best[0], best[1], best[2]));
  found.moved_m = glm::length(glm::dvec3(best[3], best[4], best[5]));
  return found;
}

double window_level(const MaterialScene& scene, const RoomTransport& transport) {
  std::vector<double> ratio;
  for (const MaterialView& view : scene.views) {
    const glm::dvec3 eye(view.world_from_camera[3]);
    for (const std::uint32_t i : spread_pixels(view, kWindowPixels)) {
      const auto d = view.left_out[i] ? std::nullopt : pixel_direction(view, position(view, i));
      const auto sky = d ? transport.seen_sky(eye, *d, view.sky) : std::nullopt;
      if (sky && sky->g > 0)
        ratio.push_back(static_cast<double>(view.radiance.texels[i].g / sky->g));
    }
  }
  if (ratio.size() < kFewestWindow)
    return 0.0;
  const auto middle = ratio.begin() + static_cast<std::ptrdiff_t>(ratio.size() / 2);
  std::nth_element(ratio.begin(), middle, ratio.end());
  return *middle;
}

RgbImage computed_picture(const MaterialView& view, const RoomTransport& transport, const MaterialFit& fit,
                          int width_px) {
  const double step = static_cast<double>(view.radiance.width) / width_px;
  RgbImage out(width_px, std::max(1, static_cast<int>(view.radiance.height / step)));
  const glm::dvec3 eye(view.world_from_camera[3]);
  parallel_for(0, out.height, [&](int y) {
    for (int x = 0; x < out.width; ++x) {
      const auto d = pixel_direction(view, {(x + 0.5) * step - 0.5, (y + 0.5) * step - 0.5});
      if (const auto light = d ? computed(eye, *d, view.sky, transport, fit) : std::nullopt)
        out.at(x, y) = *light;
    }
  });
  return out;
}

} // namespace daylit::calibration
