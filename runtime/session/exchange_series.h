#pragma once

// What leaves the objects after one exchange of light with the room after another.

#include <span>
#include <vector>

#include "runtime/object/relight.h"

namespace daylit {

/// The changes from exchange to exchange fall about geometrically, by the part q of the light that comes back, so that
/// all further ones together add q / (1 - q) of the last (Aitken 1926; of all senders together: Irons & Tuck 1969).
class ExchangeSeries {
public:
  /// `direct`: what leaves each sender of direct light; kept by reference.
  ExchangeSeries(std::span<const TwoSided> radiance, std::span<const TwoSided> direct)
      : last_(radiance.begin(), radiance.end()), direct_(direct) {}

  /// What they send beside `direct` after one more exchange. True: what the next ones add is small.
  bool add(std::span<const TwoSided> radiance);
  /// What they send after all further exchanges.
  std::vector<TwoSided> limit() const;

private:
  std::vector<TwoSided> last_, change_; ///< change_: of the last exchange; empty before the first
  std::span<const TwoSided> direct_;
  double ratio_ = 0; ///< of the last change to the one before
};

} // namespace daylit
