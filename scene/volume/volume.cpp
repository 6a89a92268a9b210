#include "scene/volume/volume.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <ranges>

#include "scene/core/parallel.h"
#include "sh/band4.h"
#include "sh/sh9.h"
#include "sh/window.h"

// One binary for all machines: the compiler makes a copy of the loop per vector width and the loader picks one.
// Sanitizers run before the loader can choose, so they get the plain copy.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define DAYLIT_VECTOR_CLONES __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#else
#define DAYLIT_VECTOR_CLONES
#endif

namespace daylit {

namespace {

// Three colours do not divide a vector; 48 floats are whole vectors of any width up to 16 and whole colours.
constexpr std::size_t kPattern = 48;
// A tile's sums stay in the first-level cache while every row passes once: 32 patterns, 6 KB.
constexpr std::size_t kTile = 32 * kPattern;
constexpr std::size_t kRowsAtOnce = 4;

/// sum[k] += row0[k] * scale0[k mod 48] + ... over `floats` (a multiple of 48).
DAYLIT_VECTOR_CLONES
void add_rows(float* __restrict sum, const float* const* rows, const float* __restrict scales, std::size_t floats) {
  const float* __restrict r0 = rows[0];
  const float* __restrict r1 = rows[1];
  const float* __restrict r2 = rows[2];
  const float* __restrict r3 = rows[3];
  for (std::size_t base = 0; base < floats; base += kPattern)
    for (std::size_t k = 0; k < kPattern; ++k)
      sum[base + k] += (r0[base + k] * scales[k] + r1[base + k] * scales[kPattern + k]) +
                       (r2[base + k] * scales[2 * kPattern + k] + r3[base + k] * scales[3 * kPattern + k]);
}

/// Rows whose region is not black, with each radiance repeated to a pattern; padded with zero weights to groups of
/// four.
struct LitRows {
  std::vector<const float*> rows;
  std::vector<float> scales;
};

/// `basis`: one of the volume's.
LitRows lit_rows(const BasisVolume& volume, const std::vector<float>& basis, std::span<const Rgb> region_radiance) {
  LitRows lit;
  for (std::size_t r = 0; r < volume.stored_region.size(); ++r) {
    const Rgb radiance = region_radiance[static_cast<std::size_t>(volume.stored_region[r])];
    if (radiance == Rgb(0.0f))
      continue;
    lit.rows.push_back(basis.data() + r * volume.row_floats());
    for (std::size_t k = 0; k < kPattern; ++k)
      lit.scales.push_back(radiance[static_cast<int>(k % 3)]);
  }
  while (lit.rows.size() % kRowsAtOnce != 0) {
    lit.rows.push_back(lit.rows.back());
    lit.scales.insert(lit.scales.end(), kPattern, 0.0f);
  }
  return lit;
}

/// Floats [first, first + count) of the sum over all rows. The tail of a volume is not a multiple of the pattern:
/// it is summed from copies padded with zeros, by the same operations.
void combine_tile(const LitRows& lit, std::size_t first, std::size_t count, float* result) {
  const std::size_t whole = count - count % kPattern, tail = count - whole;
  std::array<float, kPattern> tail_sum{};
  std::array<std::array<float, kPattern>, kRowsAtOnce> tail_rows{};
  for (std::size_t r = 0; r < lit.rows.size(); r += kRowsAtOnce) {
    std::array<const float*, kRowsAtOnce> rows;
    for (std::size_t k = 0; k < kRowsAtOnce; ++k)
      rows[k] = lit.rows[r + k] + first;
    const float* scales = lit.scales.data() + r * kPattern;
    add_rows(result, rows.data(), scales, whole);
    if (tail == 0)
      continue;
    for (std::size_t k = 0; k < kRowsAtOnce; ++k) {
      std::copy_n(rows[k] + whole, tail, tail_rows[k].begin());
      rows[k] = tail_rows[k].data();
    }
    add_rows(tail_sum.data(), rows.data(), scales, kPattern);
  }
  std::copy_n(tail_sum.begin(), tail, result + whole);
}

void combine_rows(const BasisVolume& volume, const std::vector<float>& basis, std::span<const Rgb> region_radiance,
                  std::vector<std::array<Rgb, 9>>& probes) {
  const LitRows lit = lit_rows(volume, basis, region_radiance);
  const std::size_t floats = volume.row_floats();
  if (lit.rows.empty() || floats == 0)
    return;
  float* result = &probes[0][0].x;
  parallel_for(tbb::blocked_range<std::size_t>(0, (floats + kTile - 1) / kTile), [&](const auto& tiles) {
    for (std::size_t t = tiles.begin(); t < tiles.end(); ++t)
      combine_tile(lit, t * kTile, std::min(kTile, floats - t * kTile), result + t * kTile);
  });
}

/// Irradiance of one channel over all normals as a series to degree 4.
std::array<double, 25> irradiance_series(const ShRadiance& radiance, int channel) {
  std::array<double, 25> e{};
  for (std::size_t i = 0; i < 9; ++i) {
    e[i] = static_cast<double>(sh::kClampedCosine9<float>[i]) * static_cast<double>(radiance.nine[i][channel]);
    e[16 + i] = sh::kClampedCosineBand4<double> * static_cast<double>(radiance.band4[i][channel]);
  }
  return e;
}

/// Whether the series is non-negative for what its band 4 can be at most (Cauchy-Schwarz) beside the exact minimum of
/// the rest; a series without that band is then decided.
bool surely_nonnegative(const std::array<double, 25>& e) {
  double square = 0;
  for (std::size_t i = 16; i < 25; ++i)
    square += e[i] * e[i];
  const auto lowest = sh::minimum_on_sphere(std::span(e).first(9));
  return lowest && lowest->value >= std::sqrt(square * 9.0 / (4.0 * std::numbers::pi));
}

} // namespace

std::vector<std::uint8_t> regions_that_count(const BasisVolume& volume) {
  std::vector<std::uint8_t> counts(static_cast<std::size_t>(volume.partition.size()), 0);
  for (const std::int32_t region : volume.stored_region)
    counts[static_cast<std::size_t>(region)] = 1;
  if (volume.compact)
    counts = lit_regions(volume.compact->light, counts.size());
  return counts;
}

LightField combine(const BasisVolume& volume, std::span<const Rgb> region_radiance, ShOrder order) {
  static_assert(sizeof(Sh9Rgb) == 27 * sizeof(float));
  assert(region_radiance.size() == static_cast<std::size_t>(volume.partition.size()));
  LightField field;
  field.probe.assign(volume.probes.size(), Sh9Rgb{});
  if (order == ShOrder::fourth && volume.has_band4())
    field.band4.assign(volume.probes.size(), Band4Rgb{});
  if (volume.compact) {
    combine(*volume.compact, region_radiance, field.probe, field.band4);
    return field;
  }
  combine_rows(volume, volume.basis, region_radiance, field.probe);
  if (!field.band4.empty())
    combine_rows(volume, volume.band4, region_radiance, field.band4);
  return field;
}

Rgb irradiance(const Sh9Rgb& radiance_coefficients, const glm::vec3& unit_normal) {
  const std::array<float, 9> y = sh::evaluate9<float>(unit_normal);
  Rgb sum(0.0f);
  for (std::size_t i = 0; i < 9; ++i)
    sum += sh::kClampedCosine9<float>[i] * y[i] * radiance_coefficients[i];
  return sum;
}

Rgb irradiance(const ShRadiance& radiance, const glm::vec3& unit_normal) {
  const std::array<float, 9> y = sh::evaluate_band4<float>(unit_normal);
  Rgb sum(0.0f);
  for (std::size_t i = 0; i < 9; ++i)
    sum += y[i] * radiance.band4[i];
  return irradiance(radiance.nine, unit_normal) + sh::kClampedCosineBand4<float> * sum;
}

NonNegativeLight without_ringing(const ShRadiance& radiance) {
  NonNegativeLight light{radiance};
  for (int c = 0; c < 3; ++c) {
    const std::array<double, 25> e = irradiance_series(radiance, c);
    if (!(e[0] > 0.0)) { // darkness, or rounding below it
      light.windowed_channels += e[0] < 0.0 ? 1 : 0;
      for (std::size_t i = 0; i < 9; ++i)
        light.radiance.nine[i][c] = light.radiance.band4[i][c] = 0.0f;
      continue;
    }
    if (surely_nonnegative(e))
      continue;
    const bool flat = std::ranges::all_of(e | std::views::drop(16), [](double x) { return x == 0.0; });
    const auto window = sh::nonnegative_window(std::span(e).first(flat ? 9 : 25));
    if (!window || window->strength == 0.0)
      continue;
    ++light.windowed_channels;
    light.bias = std::max(light.bias, window->bias.rms_change / (e[0] / std::sqrt(4 * std::numbers::pi)));
    for (std::size_t i = 1; i < 9; ++i)
      light.radiance.nine[i][c] *= static_cast<float>(window->bands[i < 4 ? 1 : 2]);
    for (std::size_t i = 0; i < 9 && !flat; ++i)
      light.radiance.band4[i][c] *= static_cast<float>(window->bands[4]);
  }
  return light;
}

} // namespace daylit
