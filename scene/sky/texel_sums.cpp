// The sum of one region's pixels: four lanes hold a pixel's three channels and the red of the next, which is not used.

#include <array>

#include "scene/sky/region_texels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "scene/sky/texel_sums.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace daylit::detail::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using FourLanes = hn::CappedTag<float, 4>;
constexpr std::size_t kVectors = 4 / hn::MaxLanes(FourLanes()); ///< that hold four lanes
constexpr std::size_t kChains = 4;                              ///< sums side by side: an addition waits for the last
constexpr std::size_t kMostFloats = 128;                        ///< texels that are summed in floats

struct LaneSums {
  hn::Vec<FourLanes> chain[kChains][kVectors];

  LaneSums() { clear(); }
  void clear() {
    for (auto& c : chain)
      for (auto& v : c)
        v = hn::Zero(FourLanes());
  }
  void add(std::size_t c, float weight, const float* texel) {
    for (std::size_t v = 0; v < kVectors; ++v)
      chain[c][v] = hn::MulAdd(hn::Set(FourLanes(), weight),
                               hn::LoadU(FourLanes(), texel + v * hn::MaxLanes(FourLanes())), chain[c][v]);
  }
  void move_to(std::array<double, 3>& total) {
    HWY_ALIGN float lane[4];
    for (std::size_t v = 0; v < kVectors; ++v)
      hn::StoreU(hn::Add(hn::Add(chain[0][v], chain[1][v]), hn::Add(chain[2][v], chain[3][v])), FourLanes(),
                 lane + v * hn::MaxLanes(FourLanes()));
    for (std::size_t k = 0; k < 3; ++k)
      total[k] += static_cast<double>(lane[k]);
    clear();
  }
};

/// sum[c] = sum of weight times texel over all runs, steradian times radiance. Floats err by 2^-24 of the sum per
/// addition, at most kMostFloats / kChains and a run of them in a chain; the rest is added in double. `picture`: all
/// texels, one after another.
std::array<double, 3> sum_texels(std::span<const RegionTexels::Run> runs, const float* weight,
                                 std::span<const Rgb> picture) {
  std::array<double, 3> total{};
  LaneSums sums;
  std::size_t in_floats = 0;
  for (const RegionTexels::Run& run : runs) {
    const bool reaches_end = run.first + std::size_t{run.count} == picture.size();
    const std::size_t count = reaches_end ? run.count - std::size_t{1} : run.count;
    const float* texel = &picture[run.first].r;
    std::size_t k = 0;
    for (; k + kChains <= count; k += kChains)
      for (std::size_t c = 0; c < kChains; ++c)
        sums.add(c, weight[k + c], texel + 3 * (k + c));
    for (; k < count; ++k)
      sums.add(0, weight[k], texel + 3 * k);
    if (reaches_end) // nothing can be read behind the last texel
      for (std::size_t c = 0; c < 3; ++c)
        total[c] += static_cast<double>(weight[count] * texel[3 * count + c]);
    weight += run.count;
    if ((in_floats += run.count) >= kMostFloats) {
      sums.move_to(total);
      in_floats = 0;
    }
  }
  sums.move_to(total);
  return total;
}

} // namespace daylit::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace daylit::detail {

HWY_EXPORT(sum_texels);

std::array<double, 3> RegionTexels::sum(std::span<const Rgb> picture) const {
  return HWY_DYNAMIC_DISPATCH(sum_texels)(runs, weight_sr.data(), picture);
}

} // namespace daylit::detail

#endif // HWY_ONCE
