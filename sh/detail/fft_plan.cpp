#include "sh/detail/fft_plan.h"

#include <cmath>
#include <numbers>

namespace daylit::sh::detail {
namespace {

std::vector<int> factorise(int n) {
  std::vector<int> factors;
  for (const int radix : {8, 4, 2, 3, 5})
    while (n % radix == 0) {
      factors.push_back(radix);
      n /= radix;
    }
  for (int p = 7; n > 1; p += 2) {
    if (p * p > n)
      p = n;
    while (n % p == 0) {
      factors.push_back(p);
      n /= p;
    }
  }
  return factors;
}

/// exp(-2 pi i k / n)
void append_root(std::vector<double>& to, long k, long n) {
  const long double angle = -2.0L * std::numbers::pi_v<long double> * static_cast<long double>(k % n) / n;
  to.push_back(double(std::cos(angle)));
  to.push_back(double(std::sin(angle)));
}

} // namespace

int fast_even_length(int least) {
  for (int half = std::max(1, (least + 1) / 2);; ++half) {
    int rest = half;
    for (const int p : {2, 3, 5})
      while (rest % p == 0)
        rest /= p;
    if (rest == 1)
      return 2 * half;
  }
}

FftPlan::FftPlan(int samples) : samples_(samples), halved_(samples % 2 == 0) {
  passes_.length = halved_ ? samples / 2 : samples;
  radices_ = factorise(passes_.length);
  long length = passes_.length;
  for (const int radix : radices_) {
    const long groups = length / radix;
    for (long p = 0; p < groups; ++p)
      for (long k = 1; k < radix; ++k)
        append_root(twiddles_, p * k, length);
    root_offsets_.push_back(int(roots_.size()));
    for (long k = 0; k < radix; ++k)
      append_root(roots_, k, radix);
    length = groups;
  }
  if (halved_)
    for (long k = 0; k <= passes_.length; ++k)
      append_root(real_twiddles_, k, samples);
}

FftPasses FftPlan::passes() const {
  FftPasses p = passes_;
  p.count = int(radices_.size());
  p.radix = radices_.data();
  p.twiddle = twiddles_.data();
  p.real_twiddle = halved_ ? real_twiddles_.data() : nullptr;
  p.root = roots_.data();
  p.root_offset = root_offsets_.data();
  return p;
}

} // namespace daylit::sh::detail
