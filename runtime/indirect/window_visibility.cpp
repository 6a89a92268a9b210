#include "runtime/indirect/window_visibility.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include <glm/geometric.hpp>

#include "runtime/indirect/room_planes.h"
#include "runtime/object/ray_fan.h"
#include "scene/room/aperture.h"

namespace daylit {

namespace {
constexpr int kWindowPoints = 4; ///< per side: those of a window fill a packet of rays
constexpr int kSunSamples = 8;

/// The k-th of a window's points.
glm::dvec3 window_point(const Aperture& a, int k) {
  const std::size_t last = a.corners.size() - 1;
  const double s = (k / kWindowPoints + 0.5) / kWindowPoints, t = (k % kWindowPoints + 0.5) / kWindowPoints;
  return (1 - s) * ((1 - t) * a.corners[0] + t * a.corners[last]) +
         s * ((1 - t) * a.corners[1] + t * a.corners[std::min<std::size_t>(2, last)]);
}

using Directions = std::array<glm::dvec3, kWindowPoints * kWindowPoints>;
Directions directions_of(std::span<const glm::dvec3> offsets) {
  Directions direction;
  std::ranges::transform(offsets, direction.begin(), [](const glm::dvec3& d) { return glm::normalize(d); });
  return direction;
}

} // namespace

/// Directions that fill the disc evenly; each carries the whole sun's irradiance.
void WindowVisibility::set_sun(const std::optional<DetectedSun>& detected) {
  sun_.clear();
  sun_normal_irradiance_ = detected ? detected->normal_irradiance : Rgb(0.0f);
  for (int k = 0; detected && k < kSunSamples; ++k)
    sun_.push_back(sun_disc_direction(detected->direction, k, kSunSamples));
}

/// Fraction of the windows' points that count; `none` where no window faces x. counts(window, offsets, number): bits of
/// the points at these offsets from x; the numbers are those in the window.
template <class Counts>
double WindowVisibility::weighted_fraction(const glm::dvec3& x, const glm::dvec3& n, double none, Counts counts) const {
  double seen = 0.0, all = 0.0;
  std::array<glm::dvec3, kWindowPoints * kWindowPoints> offset;
  std::array<int, kWindowPoints * kWindowPoints> number{};
  std::array<double, kWindowPoints * kWindowPoints> weight{};
  for (std::size_t w = 0; w < apertures_.size(); ++w) {
    const Aperture& a = apertures_[w];
    std::size_t count = 0;
    for (int k = 0; k < kWindowPoints * kWindowPoints; ++k) {
      const glm::dvec3 d = window_point(a, k) - x;
      const double r2 = glm::dot(d, d);
      if (glm::dot(n, d) <= 0.0 || glm::dot(a.inward, d) >= 0.0)
        continue;
      weight[count] = -glm::dot(a.inward, d) * glm::dot(n, d) / (r2 * r2);
      number[count] = k;
      offset[count++] = d;
    }
    const std::uint32_t which = count > 0 ? counts(w, std::span<const glm::dvec3>(offset.data(), count), number) : 0u;
    for (std::size_t k = 0; k < count; ++k) {
      all += weight[k];
      seen += which >> k & 1u ? weight[k] : 0.0;
    }
  }
  return all > 0.0 ? seen / all : none;
}

WindowVisibility::SeenPoints WindowVisibility::seen_points(const glm::dvec3& x) const {
  SeenPoints seen;
  for (const Aperture& a : apertures_) {
    std::array<glm::dvec3, kWindowPoints * kWindowPoints> offset;
    for (int k = 0; k < kWindowPoints * kWindowPoints; ++k)
      offset[static_cast<std::size_t>(k)] = window_point(a, k) - x;
    seen.push_back(static_cast<std::uint16_t>(past_room(x, offset)));
  }
  return seen;
}

WindowVisibility::SeenPoints WindowVisibility::not_hidden(const glm::dvec3& x, SeenPoints seen,
                                                          const PlacedParts& parts, std::size_t own) const {
  for (std::size_t w = 0; w < apertures_.size(); ++w) {
    std::array<glm::dvec3, kWindowPoints * kWindowPoints> direction;
    for (int k = 0; k < kWindowPoints * kWindowPoints; ++k)
      direction[static_cast<std::size_t>(k)] = glm::normalize(window_point(apertures_[w], k) - x);
    seen[w] &= static_cast<std::uint16_t>(~parts.occluded(x, direction, own));
  }
  return seen;
}

WindowVisibility::SeenPoints WindowVisibility::past_own(const glm::dvec3& x, SeenPoints seen,
                                                        const SenderSide& side) const {
  for (std::size_t w = 0; w < apertures_.size(); ++w)
    for (int k = 0; k < kWindowPoints * kWindowPoints; ++k)
      if (seen[w] >> k & 1u &&
          side.visible_cosine(glm::vec3(glm::normalize(window_point(apertures_[w], k) - x))) <= 0.0f)
        seen[w] &= static_cast<std::uint16_t>(~(1u << k));
  return seen;
}

float WindowVisibility::visible_fraction(const glm::dvec3& x, const glm::dvec3& n, const SeenPoints& seen) const {
  if (std::ranges::all_of(seen, [](std::uint16_t points) { return points == 0xFFFFu; }))
    return 1.0f;
  return static_cast<float>(
      weighted_fraction(x, n, 1.0, [&](std::size_t w, std::span<const glm::dvec3> offsets, const auto& number) {
        std::uint32_t which = 0;
        for (std::size_t k = 0; k < offsets.size(); ++k)
          which |= (seen[w] >> number[k] & 1u) << k;
        return which;
      }));
}

/// Offsets that no surface of the room blocks.
std::uint32_t WindowVisibility::past_room(const glm::dvec3& x, std::span<const glm::dvec3> offsets) const {
  const RayPacket16 packet = ray_fan(
      rays_.to_local(x), offsets.size(), [&](std::size_t k) { return glm::vec3(offsets[k]); }, 0.9999f);
  return ~rays_.occluded16(packet, static_cast<int>(offsets.size()));
}

/// V = integral of V cos cos / r^2 over the windows / the same with V = 1.
float WindowVisibility::visible_fraction(const glm::dvec3& x, const glm::dvec3& n) const {
  return static_cast<float>(weighted_fraction(
      x, n, 1.0, [&](std::size_t, std::span<const glm::dvec3> offsets, const auto&) { return past_room(x, offsets); }));
}

/// The same of what the parts block and the room does not. Only directions towards a part are traced against the room.
float WindowVisibility::blocked_fraction(const glm::dvec3& x, const glm::dvec3& n, const PlacedParts& parts,
                                         std::size_t ignored) const {
  return static_cast<float>(
      weighted_fraction(x, n, 0.0, [&](std::size_t, std::span<const glm::dvec3> offsets, const auto&) {
        const Directions direction = directions_of(offsets);
        const std::uint32_t covered = parts.occluded(x, {direction.data(), offsets.size()}, ignored);
        return covered ? covered & past_room(x, offsets) : 0u;
      }));
}

/// sum over the parts of (1 - T) V_part, T the mean of the straight ways to the points of windows that it covers. `x`
/// is above the surface; glass may stand on that.
Rgb WindowVisibility::kept_by_glass(const glm::dvec3& x, const glm::dvec3& n, const PlacedParts& parts) const {
  Rgb sum(0.0f);
  for (std::size_t part = 0; part < parts.size(); ++part) {
    if (!parts.part(part).glass)
      continue;
    Rgb passed(0.0f);
    float ways = 0.0f;
    const double covers =
        weighted_fraction(x, n, 0.0, [&](std::size_t, std::span<const glm::dvec3> offsets, const auto&) {
          const Directions direction = directions_of(offsets);
          const std::span<const glm::dvec3> all(direction.data(), offsets.size());
          std::uint32_t covered = parts.covered(part, x, all, ~0u);
          covered = covered ? covered & ~parts.occluded(x, all) & past_room(x, offsets) : 0u;
          for (std::uint32_t left = covered; left; left &= left - 1, ways += 1.0f)
            passed += parts.passed_straight(part, x - 0.5 * kAirGap_m * n,
                                            direction[static_cast<std::size_t>(std::countr_zero(left))]);
          return covered;
        });
    if (ways > 0.0f)
      sum += static_cast<float>(covers) * (1.0f - passed / ways);
  }
  return sum;
}

/// E = cos tau E_normal V: tau of all panes on the way; none at all where the ray crosses no aperture.
Rgb WindowVisibility::sun_sample(std::size_t k, const glm::dvec3& x, const glm::dvec3& n) const {
  if (sun_.empty())
    return Rgb(0.0f);
  const glm::dvec3 direction = sun_[k % sun_.size()];
  const double cosine = glm::dot(n, direction);
  if (cosine <= 0.0)
    return Rgb(0.0f);
  constexpr double kFar = std::numeric_limits<double>::infinity();
  int crossed = 0;
  const Rgb pane = aperture_transmittance(apertures_, x, direction, kFar, &crossed);
  if (crossed == 0 || rays_.occluded(rays_.to_local(x), glm::vec3(direction), 0.0f, static_cast<float>(kFar)))
    return Rgb(0.0f);
  return static_cast<float>(cosine) * pane * sun_normal_irradiance_;
}

Rgb WindowVisibility::sun(const glm::dvec3& x, const glm::dvec3& n) const {
  Rgb sum(0.0f);
  for (std::size_t k = 0; k < sun_.size(); ++k)
    sum += sun_sample(k, x, n);
  return sun_.empty() ? sum : sum / static_cast<float>(sun_.size());
}

/// By one sample for the whole disc: the edge of the sun's shadow is no sharper than the interpolation.
Rgb WindowVisibility::lost_sun(const glm::dvec3& x, const glm::dvec3& n, const PlacedParts& parts) const {
  const Rgb arrives = sun_sample(sun_.size() / 2, x, n);
  return arrives != Rgb(0.0f) ? arrives * (1.0f - parts.passed(x, sun_direction())) : arrives;
}

} // namespace daylit
