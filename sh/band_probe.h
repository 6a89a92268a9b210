#pragma once

// The order that a convolution needs, measured in a few directions instead of bounded.

#include <span>
#include <vector>

#include "sh/error.h"

namespace daylit::sh {

/// Values of every band of f in a few directions: which degree a convolution needs can then be read off for any
/// kernel, measured as the relative error a viewer of the map would see.
class BandProbe {
public:
  static Expected<BandProbe> create(std::span<const double> coefficients, int channels, std::span<const double> x,
                                    std::span<const double> y, std::span<const double> z);

  /// Mean over directions and channels of |truncated - full| / |full| for every degree 0 .. known. With `ratio`, the
  /// last channel is a weight and the map is the quotient of the others and it, truncated alike.
  std::vector<double> mean_relative_errors(std::span<const double> bands, bool ratio) const;

  /// Smallest degree from which on mean_relative_errors stays below `tolerance`.
  int needed_degree(std::span<const double> bands, bool ratio, double tolerance) const;

private:
  int degree_ = 0, channels_ = 0;
  std::size_t directions_ = 0;
  std::vector<double> values_; ///< [direction][degree][channel]
};

} // namespace daylit::sh
