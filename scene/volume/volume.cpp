#include "scene/volume/volume.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "scene/volume/basis_rows.h"
#include "scene/volume/interpolated_probes.h"
#include "sh/band4.h"
#include "sh/sh9.h"
#include "sh/window.h"

namespace daylit {

namespace {

/// Irradiance of one channel over all normals as a series to degree 4, e_lm = A_l L_lm: the convolution of the radiance
/// with the clamped cosine (Ramamoorthi & Hanrahan 2001). Band 3 is zero, because A_3 = 0.
std::array<double, 25> irradiance_series(const ShRadiance& radiance, int channel) {
  std::array<double, 25> e{};
  for (std::size_t i = 0; i < 9; ++i) {
    e[i] = static_cast<double>(sh::kClampedCosine9<float>[i]) * static_cast<double>(radiance.nine[i][channel]);
    e[16 + i] = sh::kClampedCosineBand4<double> * static_cast<double>(radiance.band4[i][channel]);
  }
  return e;
}

/// Whether the series is non-negative for what its band 4 can be at most beside the exact minimum of the rest: by
/// Cauchy-Schwarz and the addition theorem |sum_m e_4m Y_4m| <= sqrt(sum_m e_4m^2) sqrt(9 / (4 pi)). A series without
/// that band is then decided.
bool surely_nonnegative(const std::array<double, 25>& e) {
  double square = 0;
  for (std::size_t i = 16; i < 25; ++i)
    square += e[i] * e[i];
  const auto lowest = sh::minimum_on_sphere(std::span(e).first(9));
  return lowest && lowest->value >= std::sqrt(square * 9.0 / (4.0 * std::numbers::pi));
}

} // namespace

/// Stored rows, or nodes with a weight on some element.
std::vector<std::uint8_t> regions_that_count(const BasisVolume& volume) {
  std::vector<std::uint8_t> counts(static_cast<std::size_t>(volume.partition.size()), 0);
  for (const std::int32_t region : volume.stored_region)
    counts[static_cast<std::size_t>(region)] = 1;
  if (volume.compact)
    counts = lit_regions(volume.compact->light, counts.size());
  return counts;
}

LightField combine(const BasisVolume& volume, std::span<const Rgb> region_radiance, ShOrder order) {
  assert(region_radiance.size() == static_cast<std::size_t>(volume.partition.size()));
  LightField field;
  field.probe.assign(volume.probes.size(), Sh9Rgb{});
  if (order == ShOrder::fourth && volume.has_band4())
    field.band4.assign(volume.probes.size(), Band4Rgb{});
  if (volume.compact) {
    combine(*volume.compact, region_radiance, field.probe, field.band4);
  } else {
    const std::vector<Rgb> radiance = detail::radiance_of_rows(volume.stored_region, region_radiance);
    detail::add_basis_rows(volume.basis, radiance, field.probe);
    if (!field.band4.empty())
      detail::add_basis_rows(volume.band4, radiance, field.band4);
  }
  if (const auto interpolated = interpolated_probes(volume.probes))
    interpolate_probes(*interpolated, field);
  return field;
}

ShRadiance& ShRadiance::operator+=(const ShRadiance& other) {
  for (std::size_t i = 0; i < nine.size(); ++i) {
    nine[i] += other.nine[i];
    band4[i] += other.band4[i];
  }
  return *this;
}

/// E(n) = sum_{l <= 2} A_l L_lm Y_lm(n), A = pi, 2 pi / 3, pi / 4; in units of radiance times steradian.
Rgb irradiance(const Sh9Rgb& radiance_coefficients, const glm::vec3& unit_normal) {
  const std::array<float, 9> y = sh::evaluate9<float>(unit_normal);
  Rgb sum(0.0f);
  for (std::size_t i = 0; i < 9; ++i)
    sum += sh::kClampedCosine9<float>[i] * y[i] * radiance_coefficients[i];
  return sum;
}

/// The same and A_4 sum_m L_4m Y_4m(n), A_4 = -pi / 24.
Rgb irradiance(const ShRadiance& radiance, const glm::vec3& unit_normal) {
  const std::array<float, 9> y = sh::evaluate_band4<float>(unit_normal);
  Rgb sum(0.0f);
  for (std::size_t i = 0; i < 9; ++i)
    sum += y[i] * radiance.band4[i];
  return irradiance(radiance.nine, unit_normal) + sh::kClampedCosineBand4<float> * sum;
}

/// Channel by channel: L_lm becomes w_l L_lm with the weakest window w (sh/window.h) under which the irradiance is
/// nowhere below 0. A channel whose mean e_00 / sqrt(4 pi) is not positive is dark.
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
    const bool flat = std::all_of(e.begin() + 16, e.end(), [](double x) { return x == 0.0; });
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
