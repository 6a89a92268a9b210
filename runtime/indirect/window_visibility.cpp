#include "runtime/indirect/window_visibility.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/indirect/room_planes.h"
#include "runtime/object/ray_fan.h"
#include "scene/room/aperture.h"

namespace daylit {

namespace {
constexpr int kSide = 4; ///< points of a piece: they fill a packet of rays
constexpr std::size_t kPoints = std::size_t{kSide} * kSide;
constexpr int kSunSamples = 8;
constexpr double kNear = 0.2;          // of a piece's diagonal: nearer to it four smaller ones are better
constexpr float kSmallest = 1.0f / 32; // side of a piece

using Offsets = std::array<glm::dvec3, kPoints>;

Offsets directions_of(std::span<const glm::dvec3> offsets) {
  Offsets direction;
  std::ranges::transform(offsets, direction.begin(), [](const glm::dvec3& d) { return glm::normalize(d); });
  return direction;
}

} // namespace

/// Of the bilinear patch between the window's first two corners, its third and its last, s and t of the piece's sides.
glm::dvec3 WindowVisibility::point(const Piece& piece, double s, double t) const {
  const std::vector<glm::dvec3>& corners = apertures_[piece.window].corners;
  const std::size_t last = corners.size() - 1;
  s = static_cast<double>(piece.s) + s * static_cast<double>(piece.side);
  t = static_cast<double>(piece.t) + t * static_cast<double>(piece.side);
  return (1 - s) * ((1 - t) * corners[0] + t * corners[last]) +
         s * ((1 - t) * corners[1] + t * corners[std::min<std::size_t>(2, last)]);
}

Offsets WindowVisibility::offsets(const Piece& piece, const glm::dvec3& x) const {
  Offsets offset;
  for (int k = 0; k < static_cast<int>(kPoints); ++k)
    offset[static_cast<std::size_t>(k)] = point(piece, (k / kSide + 0.5) / kSide, (k % kSide + 0.5) / kSide) - x;
  return offset;
}

void WindowVisibility::add_pieces(const Piece& piece, const glm::dvec3& x, SeenPoints& pieces) const {
  Bounds box;
  for (const auto& [s, t] : {std::pair(0.0, 0.0), {1.0, 0.0}, {0.0, 1.0}, {1.0, 1.0}})
    box.include(point(piece, s, t));
  if (piece.side <= kSmallest || glm::distance(x, glm::clamp(x, box.min, box.max)) > kNear * glm::length(box.size())) {
    pieces.push_back(piece);
    return;
  }
  const float half = 0.5f * piece.side;
  for (const auto& [i, j] : {std::pair(0.0f, 0.0f), {half, 0.0f}, {0.0f, half}, {half, half}})
    add_pieces({piece.window, piece.s + i, piece.t + j, half}, x, pieces);
}

WindowVisibility::SeenPoints WindowVisibility::pieces_near(const glm::dvec3& x) const {
  SeenPoints pieces;
  pieces.reserve(apertures_.size());
  for (std::uint32_t w = 0; w < apertures_.size(); ++w)
    add_pieces({.window = w}, x, pieces);
  return pieces;
}

/// Directions that fill the disc evenly; each carries the whole sun's irradiance.
void WindowVisibility::set_sun(const std::optional<DetectedSun>& detected) {
  sun_.clear();
  sun_normal_irradiance_ = detected ? detected->normal_irradiance : Rgb(0.0f);
  for (int k = 0; detected && k < kSunSamples; ++k)
    sun_.push_back(sun_disc_direction(detected->direction, k, kSunSamples));
}

/// Fraction of the pieces' points that count, each by cos cos A / r^2; `none` where no window faces x. counts(piece,
/// offsets, which): bits of the points at these offsets from x; `which` they are of the piece.
template <class Counts>
double WindowVisibility::weighted_fraction(const SeenPoints& pieces, const glm::dvec3& x, const glm::dvec3& n,
                                           double none, Counts counts) const {
  double seen = 0.0, all = 0.0;
  Offsets offset;
  std::array<int, kPoints> which{};
  std::array<double, kPoints> weight{};
  for (const Piece& piece : pieces) {
    const glm::dvec3& inward = apertures_[piece.window].inward;
    const glm::dvec3 corner = point(piece, 0.0, 0.0);
    const double area = glm::length(glm::cross(point(piece, 1.0, 0.0) - corner, point(piece, 0.0, 1.0) - corner));
    std::size_t count = 0;
    int number = 0;
    for (const glm::dvec3& d : offsets(piece, x)) {
      const int k = number++;
      const double r2 = glm::dot(d, d);
      if (glm::dot(n, d) <= 0.0 || glm::dot(inward, d) >= 0.0)
        continue;
      weight[count] = -glm::dot(inward, d) * glm::dot(n, d) * area / (r2 * r2);
      which[count] = k;
      offset[count++] = d;
    }
    const std::uint32_t bits = count > 0 ? counts(piece, std::span<const glm::dvec3>(offset.data(), count), which) : 0u;
    for (std::size_t k = 0; k < count; ++k) {
      all += weight[k];
      seen += bits >> k & 1u ? weight[k] : 0.0;
    }
  }
  return all > 0.0 ? seen / all : none;
}

WindowVisibility::SeenPoints WindowVisibility::seen_points(const glm::dvec3& x) const {
  SeenPoints seen = pieces_near(x);
  for (Piece& piece : seen)
    piece.points = static_cast<std::uint16_t>(past_room(x, offsets(piece, x)));
  return seen;
}

WindowVisibility::SeenPoints WindowVisibility::not_hidden(const glm::dvec3& x, SeenPoints seen,
                                                          const PlacedParts& parts, std::size_t own) const {
  for (Piece& piece : seen)
    piece.points &= static_cast<std::uint16_t>(~parts.occluded(x, directions_of(offsets(piece, x)), own));
  return seen;
}

WindowVisibility::SeenPoints WindowVisibility::past_own(const glm::dvec3& x, SeenPoints seen,
                                                        const SenderSide& side) const {
  for (Piece& piece : seen) {
    const Offsets direction = directions_of(offsets(piece, x));
    for (std::size_t k = 0; k < kPoints; ++k)
      if (piece.points >> k & 1u && side.visible_cosine(glm::vec3(direction[k])) <= 0.0f)
        piece.points &= static_cast<std::uint16_t>(~(1u << k));
  }
  return seen;
}

float WindowVisibility::visible_fraction(const glm::dvec3& x, const glm::dvec3& n, const SeenPoints& seen) const {
  if (std::ranges::all_of(seen, [](const Piece& piece) { return piece.points == 0xFFFFu; }))
    return 1.0f;
  return static_cast<float>(weighted_fraction(
      seen, x, n, 1.0, [](const Piece& piece, std::span<const glm::dvec3> offsets, const auto& which) {
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < offsets.size(); ++k)
          bits |= (piece.points >> which[k] & 1u) << k;
        return bits;
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
  return static_cast<float>(
      weighted_fraction(pieces_near(x), x, n, 1.0, [&](const Piece&, std::span<const glm::dvec3> offsets, const auto&) {
        return past_room(x, offsets);
      }));
}

/// The same of what the parts block and the room does not. Only directions towards a part are traced against the room.
float WindowVisibility::blocked_fraction(const glm::dvec3& x, const glm::dvec3& n, const PlacedParts& parts,
                                         std::size_t ignored) const {
  return static_cast<float>(
      weighted_fraction(pieces_near(x), x, n, 0.0, [&](const Piece&, std::span<const glm::dvec3> offsets, const auto&) {
        const Offsets direction = directions_of(offsets);
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
    const double covers = weighted_fraction(
        pieces_near(x), x, n, 0.0, [&](const Piece&, std::span<const glm::dvec3> offsets, const auto&) {
          const Offsets direction = directions_of(offsets);
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
