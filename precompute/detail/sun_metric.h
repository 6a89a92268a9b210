#pragma once

// What a small sun anywhere in the sky throws on the sources: the measure of the error of a compact basis.

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/surface_light.h"
#include "scene/first_light.h"

namespace daylit::precompute::detail {

/// Columns of the first light (mean of the colours), one per node that lights anything: light of radiance 1.
struct SunColumns {
  std::size_t sources = 0;
  std::vector<std::int32_t> node;
  std::vector<std::size_t> begin; ///< of each column's entries, and the end
  std::vector<std::uint32_t> source;
  std::vector<float> value;

  static SunColumns of(const SurfaceLight& light, int regions);
  std::size_t size() const { return node.size(); }
  /// Adds to norm2[column] the squared norm of rows [row][source] times the column.
  void add_norms2(std::span<const float> rows, std::vector<double>& norm2) const;
};

/// With weights d per column: sigma_s^2 = sum d^2 H_s^2, and the correlation sum d^2 H_s H_t / (sigma_s sigma_t).
struct SunMetric {
  std::vector<float> sigma;
  std::vector<float> correlation; ///< [source][source]
  SunMetric() = default;
  SunMetric(const SunColumns& columns, std::span<const float> weight);
  /// From sums of products (in `correlation`) to both.
  void normalise();
};

/// The rows as they are stored, each divided by `unit` of its source: half floats in runs of neighbouring nodes.
FirstLight store_first_light(const SurfaceLight& light, std::span<const float> unit);

} // namespace daylit::precompute::detail
