#include "runtime/maps/detail/tile_pairs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>

namespace daylit::detail {
namespace {

constexpr int kMostOrder = 16;
/// Radians: a longer ellipse would keep too many tiles near the lobe's edge, cos = 0, from being summed at points.
constexpr double kMostReach = 0.3;

/// Four coordinates, each interpolated through the others' interpolation, which enlarges errors by the Lebesgue
/// constant 2 / pi ln(order) + 1 of about three of them; they do not add up in the worst way, so once is taken.
double interpolation_error(int order, double rho, double exponent, double eta) {
  const double lebesgue = 2.0 / std::numbers::pi * std::log(order) + 1.0;
  return 4.0 * lebesgue * 4.0 / (rho - 1.0) * std::pow(rho, -order) * std::pow(std::cosh(eta), exponent);
}

} // namespace

std::optional<SmoothLobe> smooth_lobe(double exponent, double half, std::size_t texels, double wanted) {
  for (int order = 3; order <= kMostOrder && 4 * order * order <= 3 * static_cast<int>(texels); ++order) {
    SmoothLobe best{order, 0.0, 0.0, std::numeric_limits<double>::infinity()};
    for (double rho = 1.5; half * (rho + 1.0 / rho) / 2.0 <= kMostReach; rho *= 1.1) {
      const double eta = half * (rho - 1.0 / rho) / 2.0, error = interpolation_error(order, rho, exponent, eta);
      if (error < best.error_at_0)
        best = {order, half * (rho + 1.0 / rho) / 2.0, eta, error};
    }
    if (best.error_at_0 <= wanted)
      return best;
  }
  return std::nullopt;
}

PairBounds pair_bounds(const TileFrame& tile, const MapTiles& source, const SmoothLobe* smooth) {
  constexpr float kNever = std::numeric_limits<float>::infinity();
  PairBounds b;
  for (const TileFrame& other : source.tiles) {
    const double between = std::acos(std::clamp(glm::dot(tile.centre, other.centre), -1.0, 1.0));
    const double nearest = std::max(0.0, between - tile.radius - other.radius);
    b.cosine.push_back(nearest < std::numbers::pi / 2.0 ? static_cast<float>(std::log2(std::cos(nearest))) : -kNever);
    if (!smooth)
      continue;
    const double around = tile.box_radius() + other.box_radius() + smooth->reach;
    const double cosine = std::cos(std::max(0.0, between - around)), sinh = std::sinh(smooth->eta);
    b.ellipse.push_back(
        between + around < std::numbers::pi / 2.0
            ? static_cast<float>(0.5 * std::log2(cosine * cosine + sinh * sinh) - std::log2(std::cosh(smooth->eta)))
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
