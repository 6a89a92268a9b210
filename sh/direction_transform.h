#pragma once

// Analysis and synthesis for any set of directions: angular maps, fish-eye images, scattered samples. Directions come
// with weights (true solid angles, in sr); what they are pixels of is the caller's business.
//
// Directions with bitwise equal |z| have one set of Legendre functions: in an angular map whose axis is z, eight pixels
// do. Directions that differ in the signs of x and y only have one sum over the azimuth. Time: (distinct |z|) x
// degree^2
// + (distinct |x|, |y|, z) x degree. Storage as in sh/transform.h.

#include <memory>
#include <span>

#include "sh/error.h"

namespace daylit::sh {

class DirectionTransform {
public:
  /// Unit directions (within kUnitTolerance) as arrays. One object serves one thread at a time.
  static Expected<DirectionTransform> create(std::span<const double> x, std::span<const double> y,
                                             std::span<const double> z, int degree);
  DirectionTransform(DirectionTransform&&) noexcept;
  DirectionTransform& operator=(DirectionTransform&&) noexcept;
  ~DirectionTransform();

  /// The same directions at another degree; what was sorted is shared.
  Expected<DirectionTransform> at_degree(int degree) const;

  int degree() const;
  std::size_t directions() const;

  /// values[k * channels + c] = sum of coefficient x Y_lm(direction k).
  Expected<void> synthesise(std::span<const double> coefficients, int channels, std::span<double> values);

  /// coefficients = sum over directions of weight_sr x value x Y_lm (quadrature). With weights of 1: the transpose of
  /// synthesise().
  Expected<void> analyse(std::span<const double> values, std::span<const double> weight_sr, int channels,
                         std::span<double> coefficients);

private:
  struct State;
  explicit DirectionTransform(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

} // namespace daylit::sh
