#include "bench/plain_read.h"

#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bench/plain_read.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace daylit::bench::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Four sums side by side, so that reading and not adding decides.
std::uint64_t sum_of_words(const std::uint64_t* word, std::size_t count) {
  const hn::ScalableTag<std::uint64_t> d;
  const std::size_t lanes = hn::Lanes(d);
  auto a = hn::Zero(d), b = a, c = a, e = a;
  for (std::size_t k = 0; k + 4 * lanes <= count; k += 4 * lanes) {
    a = hn::Add(a, hn::LoadU(d, word + k));
    b = hn::Add(b, hn::LoadU(d, word + k + lanes));
    c = hn::Add(c, hn::LoadU(d, word + k + 2 * lanes));
    e = hn::Add(e, hn::LoadU(d, word + k + 3 * lanes));
  }
  return hn::GetLane(hn::Add(hn::Add(a, b), hn::Add(c, e)));
}

} // namespace daylit::bench::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace daylit::bench {

HWY_EXPORT(sum_of_words);

void read_plainly(std::span<const std::byte> bytes) {
  // A call through a pointer: no compiler leaves it out.
  (void)HWY_DYNAMIC_DISPATCH(sum_of_words)(reinterpret_cast<const std::uint64_t*>(bytes.data()), bytes.size() / 8);
}

} // namespace daylit::bench

#endif // HWY_ONCE
