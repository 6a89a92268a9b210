#pragma once

// What a small sun anywhere in the sky throws on the sources: the measure of the error of a compact basis.

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/surface_light.h"
#include "radiosity/detail/sampling.h"
#include "scene/volume/first_light.h"

namespace daylit::precompute::detail {

/// Number `index` of a sequence of +1 and -1.
inline float random_sign(std::uint64_t index) { return radiosity::mix_bits(index * 2 + 1) >> 63 != 0 ? 1.0f : -1.0f; }

inline std::vector<float> random_signs(std::uint64_t seed, std::size_t count) {
  std::vector<float> s(count);
  for (std::size_t k = 0; k < s.size(); ++k)
    s[k] = random_sign(seed * 0x100000000ull + k);
  return s;
}

/// Columns of the first light (mean of the colours), one per node that lights anything: light of radiance 1.
struct SunColumns {
  std::size_t sources = 0;
  std::vector<std::int32_t> node;
  std::vector<std::size_t> begin; ///< of each column's entries, and the end
  std::vector<std::uint32_t> source;
  std::vector<float> value;

  static SunColumns of(const SurfaceLight& light, int regions);
  std::size_t size() const { return node.size(); }
  /// Irradiance [source][count] of random suns, each node weighted by `weight`: each of them a set of nodes far apart,
  /// with random signs. Their mean square is that of all nodes.
  std::vector<float> random_suns(std::span<const float> weight, std::size_t count) const;
  /// Adds to norm2[column] the squared norm of rows [row][source] times the column.
  void add_norms2(std::span<const float> rows, std::vector<double>& norm2) const;
};

/// Rows of many blocks joined to a few by sums with random signs: the expected square of the product with any vector is
/// that of all rows.
class JoinedRows {
public:
  /// `blocks` of `rows` rows each.
  JoinedRows(std::size_t blocks, std::size_t rows, std::size_t columns);
  void add(std::size_t block, std::span<const float> rows);
  const std::vector<float>& rows() const { return joined_; }

private:
  std::size_t rows_, columns_, count_;
  std::vector<float> joined_;
};

/// The covariance of the irradiance on the sources under a sun at a random node, with weights d per column:
/// M_st = sum d^2 H_s H_t. It is kept as a sketch, M = sigma sample sample^T sigma, because the whole matrix grows with
/// the square of the sources; where there are no more nodes than columns it is exact.
struct SunMetric {
  std::vector<float> sigma; ///< unit of each source: the root of M_ss
  std::size_t columns = 0;
  std::vector<float> sample; ///< [source][column], rows of length 1
  SunMetric() = default;
  /// Of at most `most` columns.
  SunMetric(const SunColumns& suns, std::span<const float> weight, std::size_t most);
  /// From a sample of M itself, [source][columns], to both.
  SunMetric(std::vector<float> irradiance, std::size_t columns);
};

/// The rows as they are stored, each divided by `unit` of its source: half floats in runs of neighbouring nodes.
FirstLight store_first_light(const SurfaceLight& light, std::span<const float> unit);

} // namespace daylit::precompute::detail
