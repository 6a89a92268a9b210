#include "runtime/shading/visibility.h"

#include <bit>

#include "runtime/shading/lane_kernels.h"

namespace daylit {

void write_known_lights(const BlockedLights& blocked, std::span<KnownLights* const> words) {
  const std::size_t lights = blocked.verdicts.size();
  for (std::size_t first = 0; first < lights; first += kLightsPerWord) {
    const std::size_t count = std::min(kLightsPerWord, lights - first);
    LaneMask clear_lanes[kLightsPerWord], blocked_lanes[kLightsPerWord];
    for (std::size_t j = 0; j < count; ++j) {
      clear_lanes[j] = blocked.verdicts[first + j].clear;
      blocked_lanes[j] = blocked.verdicts[first + j].blocked;
    }
    alignas(64) std::uint64_t clear[kLanes], taken[kLanes];
    lanes::transpose({clear_lanes, count}, clear);
    lanes::transpose({blocked_lanes, count}, taken);
    for (std::size_t k = 0; k < words.size(); ++k)
      words[k][first / kLightsPerWord] = {clear[k], taken[k]};
  }
}

void LightHints::believe_agreeing(int lane, std::span<const KnownLights* const> neighbours) {
  if (neighbours.size() < 2)
    return;
  for (std::size_t word = 0; word < words_for(verdicts_.size()); ++word) {
    std::uint64_t clear = ~std::uint64_t{0}, blocked = clear, one = 0, two = 0;
    for (const KnownLights* words : neighbours) {
      const KnownLights& w = words[word];
      const std::uint64_t known = w.clear | w.blocked;
      two |= one & known;
      one |= known;
      clear &= ~w.blocked;
      blocked &= ~w.clear;
    }
    believe(1u << lane, word, {two & clear, two & blocked});
  }
}

void LightHints::believe(LaneMask lanes, std::size_t word, const KnownLights& known) {
  LaneVerdict* verdicts = &verdicts_[kLightsPerWord * word];
  for (std::uint64_t left = known.clear; left; left &= left - 1)
    verdicts[std::countr_zero(left)].clear |= lanes;
  for (std::uint64_t left = known.blocked; left; left &= left - 1)
    verdicts[std::countr_zero(left)].blocked |= lanes;
}

void LightHints::believe_corners(std::span<const KnownLights* const> corners) {
  constexpr LaneMask kAll = (1u << kLanes) - 1u;
  for (std::size_t word = 0; !corners.empty() && word < words_for(verdicts_.size()); ++word) {
    KnownLights all{~std::uint64_t{0}, ~std::uint64_t{0}};
    for (const KnownLights* words : corners)
      all = {all.clear & words[word].clear & ~words[word].blocked,
             all.blocked & words[word].blocked & ~words[word].clear};
    believe(kAll, word, all);
  }
}

} // namespace daylit
