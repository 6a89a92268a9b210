#include "precompute/detail/node_sharpening.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include <tbb/enumerable_thread_specific.h>

#include "scene/core/parallel.h"

namespace daylit::precompute::detail {

namespace {

/// Linear interpolation adds f'' h^2 / 12 in the mean over a cell of width h: the mean of t (1 - t) / 2 over 0..1.
constexpr double kBlur = 1.0 / 12;

using Stencil = std::map<int, double>; ///< region -> weight

/// Adds weight times the band's interpolated value at a node's azimuth.
void add_from_band(const SkyBand& band, double azimuth, double weight, Stencil& out) {
  const double start = band.centred ? -std::numbers::pi / band.cells : 0.0;
  const double cell = (azimuth - start) / (2 * std::numbers::pi) * band.cells - 0.5, first = std::floor(cell);
  const int n = band.cells, left = ((static_cast<int>(first) % n) + n) % n;
  out[band.first_region + left] += weight * (1 - (cell - first));
  out[band.first_region + (left + 1) % n] += weight * (cell - first);
}

/// D'_i = D_i - kBlur (D_{i-1} - 2 D_i + D_{i+1}) along the band, and the second difference across three bands, at
/// unequal distances u (up) and d (down): 2 (D_u / (u (u + d)) - D_0 / (u d) + D_d / (d (u + d))), times kBlur h^2, h:
/// the height of the band.
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

/// Which nodes a region's light goes to.
struct Term {
  std::int32_t node;
  float weight;
};

std::vector<std::vector<Term>> terms_of(const SkyPartition& partition) {
  std::vector<std::vector<Term>> terms(static_cast<std::size_t>(partition.size()));
  for (std::size_t b = 0; b < partition.bands().size(); ++b)
    for (int cell = 0; cell < partition.bands()[b].cells; ++cell) {
      const int node = partition.bands()[b].first_region + cell;
      for (const auto& [from, weight] : stencil_of(partition, b, cell))
        if (weight != 0)
          terms[static_cast<std::size_t>(from)].push_back(
              {node, static_cast<float>(weight * partition.solid_angle_sr(node) / partition.solid_angle_sr(from))});
    }
  return terms;
}

/// Sums per node, all zero between two rows.
struct Sums {
  explicit Sums(std::size_t nodes) : touched(nodes, 0), sum(nodes, Rgb(0.0f)) {}
  std::vector<std::uint8_t> touched;
  std::vector<Rgb> sum;
};

/// The row times the stencils, scattered node by node.
void sharpen(const std::vector<std::vector<Term>>& terms, Sums& sums, radiosity::FirstBounceRow& row) {
  auto low = static_cast<std::int32_t>(terms.size()), high = std::int32_t{-1};
  for (std::size_t k = 0; k < row.region.size(); ++k)
    for (const Term& t : terms[static_cast<std::size_t>(row.region[k])]) {
      const auto node = static_cast<std::size_t>(t.node);
      sums.touched[node] = 1;
      sums.sum[node] += t.weight * row.irradiance[k];
      low = std::min(low, t.node);
      high = std::max(high, t.node);
    }
  row.region.clear();
  row.irradiance.clear();
  for (std::int32_t n = low; n <= high; ++n) {
    const auto node = static_cast<std::size_t>(n);
    if (sums.touched[node] == 0)
      continue;
    row.region.push_back(n);
    row.irradiance.push_back(sums.sum[node]);
    sums.touched[node] = 0;
    sums.sum[node] = Rgb(0.0f);
  }
}

} // namespace

void sharpen_nodes(const SkyPartition& partition, std::vector<radiosity::FirstBounceRow>& rows) {
  const std::vector<std::vector<Term>> terms = terms_of(partition);
  tbb::enumerable_thread_specific<Sums> sums([&] { return Sums(terms.size()); });
  parallel_for(std::size_t{0}, rows.size(), [&](std::size_t i) { sharpen(terms, sums.local(), rows[i]); });
}

} // namespace daylit::precompute::detail
