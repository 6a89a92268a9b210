#pragma once

// Analysis and synthesis on rings: an image on a Gauss-Legendre, equirectangular or Clenshaw-Curtis grid to
// coefficients and back, in O(degree^3) with an FFT in longitude (own, sh/detail/fft_plan.h).
//
// Coefficients of an image with C channels: value of Y_lm, channel c, at [(l*l + l + m) * C + c]; (degree + 1)^2 * C
// numbers, always double. Real, orthonormal, no Condon-Shortley phase (sh/basis.h).
//
// Error: |round trip - input| <= 1e-12 / 1e-11 / 1e-10 of the largest coefficient at degree 255 / 1023 / 4095
// (measured: docs/sh.md). Inputs between 1e-300 and 1e300 are scaled by a power of two, so nothing overflows.

#include <cstddef>
#include <memory>
#include <span>

#include "sh/error.h"
#include "sh/quadrature.h"

namespace daylit::sh {

/// Pixels somewhere in memory: channel c of column j in row i at data[i * row_stride + j * pixel_stride + c *
/// channel_stride]. Row 0 is the northernmost ring.
template <class T>
struct ImageView {
  T* data = nullptr;
  std::ptrdiff_t row_stride = 0, pixel_stride = 0, channel_stride = 0;
  int channels = 0;
};

/// Rows of width x channels interleaved numbers, one after the other.
template <class T>
ImageView<T> interleaved(T* data, int width, int channels) {
  return {data, std::ptrdiff_t(width) * channels, channels, 1, channels};
}

/// Number of coefficients per channel: (degree + 1)^2.
constexpr std::size_t coefficient_count(int degree) { return std::size_t(degree + 1) * std::size_t(degree + 1); }

/// A grid and a degree, with the tables and the workspace of the transforms. One object serves one thread at a time.
class RingTransform {
public:
  /// `degree` may exceed what the grid resolves: synthesis stays exact, analysis is then a quadrature with aliasing.
  static Expected<RingTransform> create(const RingGrid& grid, int degree);
  RingTransform(RingTransform&&) noexcept;
  RingTransform& operator=(RingTransform&&) noexcept;
  ~RingTransform();

  int degree() const;
  const RingGrid& grid() const;

  /// image = sum of coefficient x Y_lm at every sample.
  Expected<void> synthesise(std::span<const double> coefficients, const ImageView<double>& image);
  Expected<void> synthesise(std::span<const double> coefficients, const ImageView<float>& image);

  /// coefficients = sum over samples of solid angle x value x Y_lm. Inverts synthesise() where 2 degree <=
  /// grid.exact_degree.
  Expected<void> analyse(const ImageView<const double>& image, std::span<double> coefficients);
  Expected<void> analyse(const ImageView<const float>& image, std::span<double> coefficients);

  /// Transpose of synthesise(): sum over samples of value x Y_lm, no weights.
  Expected<void> adjoint_synthesise(const ImageView<const double>& image, std::span<double> coefficients);

private:
  struct State;
  explicit RingTransform(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

} // namespace daylit::sh
