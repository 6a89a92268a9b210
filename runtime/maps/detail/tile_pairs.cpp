#include "runtime/maps/detail/tile_pairs.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>

namespace daylit::detail {
namespace {

constexpr int kMostOrder = 20;
/// Radians.
constexpr double kMostReach = 0.8;
/// cos^s with a larger s is below 1e-6 at the branch point's distance of a tile.
constexpr double kSmoothAtEdge = 8.0;

/// Of all four coordinates.
double interpolation_error(int order, double rho, double exponent, double eta) {
  return 4.0 * 4.0 / (rho - 1.0) * std::pow(rho, -order) * std::pow(std::cosh(eta), exponent);
}

} // namespace

std::optional<SmoothLobe> smooth_lobe(double exponent, double half, std::size_t texels, double wanted) {
  for (int order = 3; order <= kMostOrder && 4 * order * order <= 3 * static_cast<int>(texels); ++order) {
    SmoothLobe best{order, 0.0, 0.0, std::numeric_limits<double>::infinity(), 0.0};
    for (double rho = 1.5; half * (rho + 1.0 / rho) / 2.0 <= kMostReach; rho *= 1.1) {
      const double eta = half * (rho - 1.0 / rho) / 2.0, error = interpolation_error(order, rho, exponent, eta);
      if (error < best.error_at_0)
        best = {order, half * (rho + 1.0 / rho) / 2.0, eta, error, 0.0};
    }
    if (best.error_at_0 <= wanted) {
      best.clearance = exponent >= kSmoothAtEdge || exponent == std::floor(exponent) ? 0.0 : best.reach;
      return best;
    }
  }
  return std::nullopt;
}

namespace {

/// Radians: above it the sums of angles below would leave [0, pi).
constexpr double kWide = std::numbers::pi / 2.0;

struct Angle {
  double cosine, sine;
};
Angle angle(double radians) { return {std::cos(radians), std::sin(radians)}; }
Angle sum(const Angle& a, const Angle& b) {
  return {a.cosine * b.cosine - a.sine * b.sine, a.sine * b.cosine + a.cosine * b.sine};
}
/// cos(max(0, a - b)) for a in [0, pi], b in [0, pi): the difference is negative where cos(a) > cos(b).
double cosine_of_rest(const Angle& a, const Angle& b) {
  return a.cosine >= b.cosine ? 1.0 : a.cosine * b.cosine + a.sine * b.sine;
}

} // namespace

PairBounds pair_bounds(const TileFrame& tile, const Tiles& source, const SmoothLobe* smooth) {
  const std::size_t count = source.frames.size();
  PairBounds b;
  b.cosine.resize(count);
  b.ellipse.resize(smooth ? count : 0);
  const Angle radius = angle(tile.radius), clearance = angle(smooth ? tile.box_radius + smooth->clearance : 0.0);
  const Angle reach = angle(smooth ? tile.box_radius + smooth->reach : 0.0);
  const double most = smooth ? std::max(smooth->reach, smooth->clearance) : 0.0;
  const double sinh2 = smooth ? std::pow(std::sinh(smooth->eta), 2) : 0.0;
  for (std::size_t t = 0; t < count; ++t) {
    const TileFrame& other = source.frames[t];
    const double cosine = glm::dot(tile.centre, other.centre);
    const Angle between{cosine, std::sqrt(std::max(0.0, 1.0 - cosine * cosine))};
    const Angle other_radius{other.cos_radius, other.sin_radius}, other_box{other.cos_box, other.sin_box};
    const bool wide = tile.radius + other.radius > kWide; // a map of few texels
    b.cosine[t] = wide ? 1.0f : static_cast<float>(std::max(0.0, cosine_of_rest(between, sum(radius, other_radius))));
    if (!smooth)
      continue;
    const double near = std::max(0.0, cosine_of_rest(between, sum(reach, other_box)));
    const bool clear =
        tile.box_radius + other.box_radius + most < kWide && sum(between, sum(clearance, other_box)).cosine > 0.0;
    b.ellipse[t] = clear ? static_cast<float>((near * near + sinh2) / (1.0 + sinh2)) : -1.0f;
  }
  return b;
}

/// By the exponent bits of the floats, which are in the order of their values.
float affordable(std::span<const float> bounds, double budget) {
  constexpr std::uint32_t kInfinite = 255;
  std::array<double, kInfinite + 1> sums{};
  for (const float bound : bounds)
    sums[std::bit_cast<std::uint32_t>(bound) >> 23] += static_cast<double>(bound);
  double total = 0.0;
  std::uint32_t k = 0;
  while (k < kInfinite && (total += sums[k]) <= budget)
    ++k;
  return std::bit_cast<float>(k << 23);
}

} // namespace daylit::detail
