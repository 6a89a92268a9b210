#include "precompute/detail/node_sharpening.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace daylit::precompute::detail {

namespace {

constexpr double kBlur = 1.0 / 24 + 1.0 / 12;

using Stencil = std::map<int, double>; ///< region -> weight

/// Adds weight times the band's interpolated value at a node's azimuth.
void add_from_band(const SkyBand& band, double azimuth, double weight, Stencil& out) {
  const double start = band.centred ? -std::numbers::pi / band.cells : 0.0;
  const double cell = (azimuth - start) / (2 * std::numbers::pi) * band.cells - 0.5, first = std::floor(cell);
  const int n = band.cells, left = ((static_cast<int>(first) % n) + n) % n;
  out[band.first_region + left] += weight * (1 - (cell - first));
  out[band.first_region + (left + 1) % n] += weight * (cell - first);
}

Stencil stencil_of(const SkyPartition& partition, std::size_t b, int cell) {
  const std::vector<SkyBand>& bands = partition.bands();
  const SkyBand& band = bands[b];
  Stencil s;
  const int region = band.first_region + cell;
  s[region] = 1.0;
  if (band.cells > 2) {
    s[region] += 2 * kBlur;
    s[band.first_region + (cell + 1) % band.cells] -= kBlur;
    s[band.first_region + (cell + band.cells - 1) % band.cells] -= kBlur;
  }
  if (b == 0 || b + 1 == bands.size() || band.cells < 2)
    return s;
  const double here = std::asin(partition.centre(region).z);
  const double up = std::asin(partition.centre(bands[b + 1].first_region).z) - here;
  const double down = here - std::asin(partition.centre(bands[b - 1].first_region).z);
  const double height = std::asin(band.sin_high) - std::asin(band.sin_low);
  const double scale = kBlur * std::min(height * height, up * down);
  const glm::dvec3 centre = partition.centre(region);
  const double azimuth = std::atan2(centre.y, centre.x);
  s[region] += 2 * scale / (up * down);
  add_from_band(bands[b + 1], azimuth, -2 * scale / (up * (up + down)), s);
  add_from_band(bands[b - 1], azimuth, -2 * scale / (down * (up + down)), s);
  return s;
}

} // namespace

NodeSharpening sharpen_nodes(const SkyPartition& partition, std::span<const std::int32_t> stored) {
  std::vector<std::int32_t> column(static_cast<std::size_t>(partition.size()), -1);
  for (std::size_t k = 0; k < stored.size(); ++k)
    column[static_cast<std::size_t>(stored[k])] = static_cast<std::int32_t>(k);
  NodeSharpening result;
  for (std::size_t b = 0; b < partition.bands().size(); ++b)
    for (int cell = 0; cell < partition.bands()[b].cells; ++cell) {
      const int region = partition.bands()[b].first_region + cell;
      bool lit = false;
      for (const auto& [from, weight] : stencil_of(partition, b, cell)) {
        const std::int32_t k = column[static_cast<std::size_t>(from)];
        if (k < 0 || weight == 0)
          continue;
        if (!lit)
          result.region.push_back(region);
        lit = true;
        const double per_solid_angle = partition.solid_angle_sr(region) / partition.solid_angle_sr(from);
        result.terms.push_back({static_cast<std::uint32_t>(result.region.size() - 1), static_cast<std::uint32_t>(k),
                                static_cast<float>(weight * per_solid_angle)});
      }
    }
  return result;
}

std::vector<float> NodeSharpening::apply(std::span<const float> values, std::size_t rows, std::size_t columns) const {
  std::vector<float> out(rows * region.size(), 0.0f);
  for (std::size_t r = 0; r < rows; ++r)
    for (const Term& t : terms)
      out[r * region.size() + t.node] += t.weight * values[r * columns + t.column];
  return out;
}

} // namespace daylit::precompute::detail
