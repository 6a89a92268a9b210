// The sums of regions' pixels: four lanes hold a pixel's three channels and the red of the next, which is not used.

#include <array>

#include "scene/sky/region_texels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "scene/sky/texel_sums.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace daylit::detail::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using FourLanes = hn::CappedTag<float, 4>;
constexpr std::size_t kVectors = 4 / hn::MaxLanes(FourLanes()); ///< that hold four lanes
constexpr std::size_t kChains = 4;                              ///< sums side by side: an addition waits for the last
constexpr std::size_t kRunsAhead = 16;
constexpr std::size_t kMostFloats = 128; ///< texels that are summed in floats

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

/// The run that will be summed kRunsAhead runs later: rows of a picture are far apart, and no processor foresees the
/// next.
void fetch(std::span<const TexelRun> runs, std::size_t r, std::span<const Rgb> picture) {
  if (r + kRunsAhead >= runs.size())
    return;
  const TexelRun& ahead = runs[r + kRunsAhead];
  hwy::Prefetch(&picture[ahead.first]);
  hwy::Prefetch(&picture[ahead.first + ahead.count - 1]);
}

/// sums[region][c] = sum of weight times texel over its runs, steradian times radiance. Floats err by 2^-24 of the sum
/// per addition, at most kMostFloats / kChains and a run of them in a chain; the rest is added in double.
void sum_regions(const TexelMatrix& matrix, std::size_t first, std::size_t end, std::span<const Rgb> picture,
                 std::array<double, 3>* region_sum) {
  const float* weight = matrix.weight_sr.data() + matrix.first_weight[first];
  for (std::size_t region = first; region < end; ++region) {
    std::array<double, 3> total{};
    LaneSums sums;
    std::size_t in_floats = 0;
    for (std::size_t r = matrix.first_run[region]; r < matrix.first_run[region + 1]; ++r) {
      fetch(matrix.runs, r, picture);
      const TexelRun& run = matrix.runs[r];
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
    region_sum[region - first] = total;
  }
}

} // namespace daylit::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace daylit::detail {

HWY_EXPORT(sum_regions);

void TexelMatrix::sum(std::size_t first, std::size_t end, std::span<const Rgb> picture,
                      std::span<std::array<double, 3>> sums) const {
  HWY_DYNAMIC_DISPATCH(sum_regions)(*this, first, end, picture, sums.data());
}

} // namespace daylit::detail

#endif // HWY_ONCE
