#pragma once

// Factors and twiddles of a Fourier transform of real rings; the passes are in fft_kernel.h.

#include <vector>

#include "sh/detail/kernels.h"

namespace daylit::sh::detail {

/// Smallest even length >= `least` whose half has no prime factor above 5.
int fast_even_length(int least);

class FftPlan {
public:
  /// Real transform of `samples` values: half-length complex when even, full-length complex when odd.
  explicit FftPlan(int samples);

  bool halved() const { return halved_; }
  int bins() const { return samples_ / 2 + 1; }
  int complex_length() const { return passes_.length; }
  FftPasses passes() const;

private:
  int samples_;
  bool halved_;
  FftPasses passes_{};
  std::vector<int> radices_, root_offsets_;
  std::vector<double> twiddles_, real_twiddles_, roots_;
};

} // namespace daylit::sh::detail
