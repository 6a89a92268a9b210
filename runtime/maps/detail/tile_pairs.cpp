#include "runtime/maps/detail/tile_pairs.h"

#include <algorithm>
#include <array>
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

PairBounds pair_bounds(const TileFrame& tile, const Tiles& source, const SmoothLobe* smooth) {
  constexpr float kNever = std::numeric_limits<float>::infinity();
  PairBounds b;
  for (const TileFrame& other : source.frames) {
    const double between = std::acos(std::clamp(glm::dot(tile.centre, other.centre), -1.0, 1.0));
    const double nearest = std::max(0.0, between - tile.radius - other.radius);
    b.cosine.push_back(nearest < std::numbers::pi / 2.0 ? static_cast<float>(std::log2(std::cos(nearest))) : -kNever);
    if (!smooth)
      continue;
    const double around = tile.box_radius + other.box_radius;
    const double cosine = std::cos(std::clamp(between - around - smooth->reach, 0.0, std::numbers::pi / 2.0));
    const double sinh = std::sinh(smooth->eta), relative = (cosine * cosine + sinh * sinh) / (1.0 + sinh * sinh);
    b.ellipse.push_back(between + around + smooth->clearance < std::numbers::pi / 2.0
                            ? static_cast<float>(std::min(0.0, 0.5 * std::log2(relative)))
                            : kNever);
  }
  return b;
}

double affordable(std::span<const float> bounds, double budget) {
  constexpr int kLowest = -140, kBuckets = 200;
  std::array<double, kBuckets> sum{};
  const auto bucket = [](float bound) { return std::clamp(std::ilogb(bound) - kLowest, 0, kBuckets - 1); };
  for (const float bound : bounds)
    if (bound > 0.0f && std::isfinite(bound))
      sum[static_cast<std::size_t>(bucket(bound))] += static_cast<double>(bound);
  double total = 0.0;
  int k = 0;
  while (k < kBuckets && (total += sum[static_cast<std::size_t>(k)]) <= budget)
    ++k;
  return std::ldexp(1.0, k + kLowest);
}

} // namespace daylit::detail
