#include "precompute/detail/sun_metric.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>

#include <Imath/half.h>

#include "scene/core/parallel.h"

namespace daylit::precompute::detail {

namespace {

constexpr std::size_t kJoinedBlocks = 4; ///< as many rows as these have: a norm is off by a tenth

float mean(const Rgb& c) { return (c.r + c.g + c.b) / 3.0f; }

float largest(const radiosity::FirstBounceRow& row, int colour) {
  float most = 0;
  for (const Rgb& x : row.irradiance)
    most = std::max(most, std::abs(x[colour]));
  return most;
}

/// Whether red, green and blue are the same, and the same but for a factor of each source.
struct Tint {
  bool colourless = true, shared = true;

  /// Shared: sum over the sources of |E_c - E_0 max E_c / max E_0|^2 <= kShared^2 sum |E_c|^2.
  explicit Tint(const SurfaceLight& light) {
    constexpr double kShared = 2e-3;
    double error2 = 0, power2 = 0;
    for (const radiosity::FirstBounceRow& row : light.light) {
      const Rgb most(largest(row, 0), largest(row, 1), largest(row, 2));
      for (const Rgb& x : row.irradiance) {
        colourless = colourless && x == Rgb(x.r);
        for (int c = 1; c < 3 && most.r > 0.0f; ++c) {
          const double error = static_cast<double>(x[c] - x.r * most[c] / most.r), value = static_cast<double>(x[c]);
          error2 += error * error;
          power2 += value * value;
        }
      }
    }
    shared = error2 <= kShared * kShared * power2;
  }
};

/// A half float of 8 bits of significand instead of 11, the nearest, to even: it packs better (volume/packed_tensors),
/// and errs by at most 0.4 %.
std::uint16_t short_half(float x) {
  const auto bits = std::bit_cast<std::uint32_t>(x);
  return imath_float_to_half(std::bit_cast<float>((bits + 0x7fffu + (bits >> 16 & 1u)) & 0xffff0000u));
}

/// Weights relative to the row's largest as half floats, in whole blocks.
void append_row(const radiosity::FirstBounceRow& row, int colour, FirstLight& out) {
  constexpr std::size_t kBlock = FirstLight::kBlock;
  const float most = largest(row, colour);
  for (std::size_t k = 0; k < row.region.size() && most > 0; ++k) { // regions increase
    const auto region = static_cast<std::size_t>(row.region[k]);
    if (out.block.size() == out.first_block.back() || out.block.back() != region / kBlock) {
      out.block.push_back(static_cast<std::uint16_t>(region / kBlock));
      out.weight.insert(out.weight.end(), kBlock, std::uint16_t{0});
    }
    out.weight[out.weight.size() - kBlock + region % kBlock] = short_half(row.irradiance[k][colour] / most);
  }
  out.first_block.push_back(static_cast<std::uint32_t>(out.block.size()));
}

} // namespace

/// The rows of the first light, H_sj, by columns j; nodes that light nothing are left out.
SunColumns SunColumns::of(const SurfaceLight& light, int regions) {
  std::vector<std::size_t> count(static_cast<std::size_t>(regions), 0);
  for (const radiosity::FirstBounceRow& row : light.light)
    for (const std::int32_t r : row.region)
      ++count[static_cast<std::size_t>(r)];
  SunColumns c;
  c.sources = light.source.size();
  std::vector<std::size_t> next(count.size());
  std::size_t end = 0;
  for (std::size_t r = 0; r < count.size(); ++r) {
    next[r] = end;
    if (count[r] == 0)
      continue;
    c.node.push_back(static_cast<std::int32_t>(r));
    c.begin.push_back(end);
    end += count[r];
  }
  c.begin.push_back(end);
  c.source.resize(end);
  c.value.resize(end);
  for (std::size_t s = 0; s < light.light.size(); ++s)
    for (std::size_t k = 0; k < light.light[s].region.size(); ++k) {
      const std::size_t at = next[static_cast<std::size_t>(light.light[s].region[k])]++;
      c.source[at] = static_cast<std::uint32_t>(s);
      c.value[at] = mean(light.light[s].irradiance[k]);
    }
  return c;
}

/// norm2[j] += sum over rows of (sum_s row_s H_sj)^2
void SunColumns::add_norms2(std::span<const float> rows, std::vector<double>& norm2) const {
  const std::size_t count = sources > 0 ? rows.size() / sources : 0;
  std::vector<float> by_source(rows.size()); // [source][row]: one column reads whole lines
  for (std::size_t r = 0; r < count; ++r)
    for (std::size_t s = 0; s < sources; ++s)
      by_source[s * count + r] = rows[r * sources + s];
  parallel_for(std::size_t{0}, size(), [&](std::size_t j) {
    std::vector<float> sum(count, 0.0f);
    for (std::size_t k = begin[j]; k < begin[j + 1]; ++k)
      for (std::size_t r = 0; r < count; ++r)
        sum[r] += value[k] * by_source[source[k] * count + r];
    for (const float x : sum)
      norm2[j] += static_cast<double>(x) * static_cast<double>(x);
  });
}

/// irradiance[s, i] = sqrt(count) sum +-weight_j H_sj over the nodes j = i, i + count, ...: with random signs their
/// covariance is the metric in the mean (CountSketch: Charikar, Chen, Farach-Colton 2002), at the cost of one pass.
std::vector<float> SunColumns::random_suns(std::span<const float> weight, std::size_t count) const {
  const float scale = std::sqrt(static_cast<float>(count));
  std::vector<float> sun(sources * count, 0.0f);
  for (std::size_t j = 0; j < size(); ++j) {
    const float w = scale * weight[j] * random_sign(j * 0x10000ull + count);
    for (std::size_t k = begin[j]; k < begin[j + 1]; ++k)
      sun[source[k] * count + j % count] += w * value[k];
  }
  return sun;
}

JoinedRows::JoinedRows(std::size_t blocks, std::size_t rows, std::size_t columns)
    : rows_(rows), columns_(columns), count_(rows * std::min(blocks, kJoinedBlocks)), joined_(count_ * columns, 0.0f) {}

/// joined_r = sum over blocks of +-row / sqrt(count / rows): the signs cancel all products of two blocks in the mean.
void JoinedRows::add(std::size_t block, std::span<const float> rows) {
  const float scale = count_ > 0 ? std::sqrt(static_cast<float>(rows_) / static_cast<float>(count_)) : 0.0f;
  for (std::size_t r = 0; r < count_; ++r) {
    const float sign = scale * random_sign(block * count_ + r);
    const float* from = rows.data() + r % rows_ * columns_;
    float* to = joined_.data() + r * columns_;
    for (std::size_t k = 0; k < columns_; ++k)
      to[k] += sign * from[k];
  }
}

SunMetric::SunMetric(const SunColumns& suns, std::span<const float> weight, std::size_t most)
    : SunMetric(suns.random_suns(weight, std::clamp(suns.size(), std::size_t{1}, most)),
                std::clamp(suns.size(), std::size_t{1}, most)) {}

/// sigma_s = |irradiance_s| / sqrt(columns); sample_s = irradiance_s / |irradiance_s|
SunMetric::SunMetric(std::vector<float> irradiance, std::size_t width)
    : sigma(irradiance.size() / width), columns(width), sample(std::move(irradiance)) {
  for (std::size_t s = 0; s < sigma.size(); ++s) {
    const std::span<float> row = std::span(sample).subspan(s * columns, columns);
    const float norm = std::sqrt(std::inner_product(row.begin(), row.end(), row.begin(), 0.0f));
    // Any unit does for a source that no sun lights, or too faintly to be squared.
    sigma[s] = norm > 0.0f ? norm / std::sqrt(static_cast<float>(columns)) : 1.0f;
    for (float& x : row)
      x = norm > 0.0f ? x / norm : 0.0f;
  }
}

/// Row s in units of `unit`_s; one colour where no pane is tinted, one row where all have the same tint.
FirstLight store_first_light(const SurfaceLight& light, std::span<const float> unit) {
  const Tint tint(light);
  FirstLight out;
  out.colours = tint.colourless ? 1 : 3;
  out.first_block.push_back(0);
  for (int colour = 0; colour < static_cast<int>(out.colours); ++colour)
    for (std::size_t s = 0; s < light.light.size(); ++s) {
      out.scale.push_back(largest(light.light[s], colour) / unit[s]);
      if (colour == 0 || !tint.shared)
        append_row(light.light[s], colour, out);
    }
  return out;
}

} // namespace daylit::precompute::detail
