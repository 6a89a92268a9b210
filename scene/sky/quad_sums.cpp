#include "scene/sky/quad_sums.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <numbers>

#include "scene/core/parallel.h"
#include "scene/core/tile_kernels.h"
#include "scene/core/wide_vectors.h"
#include "scene/sky/slots.h"

#define DAYLIT_ANY_WIDTH __attribute__((target_clones("default", "arch=x86-64-v3")))

namespace daylit::detail {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kStripRows = 16;       ///< that quads follow each other in; they stay in the first cache
constexpr std::size_t kParts = 8;            ///< for the threads; fixed, so that sums do not depend on their number
constexpr std::size_t kSegmentsOfSum = 1024; ///< as many are summed before their sum goes to the nodes
constexpr std::size_t kSegmentsAhead = 32;   ///< of the sums their texels are fetched: a strip is new to the cache
constexpr double kMostShift = 1.0 / 100;     ///< of a pixel's place between the nodes by a straight line, pixels
constexpr double kMostAngleError = 5e-6;     ///< of a solid angle, by the largest
// Integers of shares are in 0..kOne.
constexpr int kStepsOfStart = 4, kMost = 32767, kOne = kStepsOfStart * kMost;
constexpr double kUnit = 1.0 / kOne / kOne; ///< of the kernels' sums

/// A straight line through the first and the last of `count` values, moved by half of the most that it misses between.
struct FittedLine {
  double first, last, error;

  template <class Value>
  FittedLine(std::size_t count, const Value& value) : first(value(0)), last(value(count - 1)) {
    double low = 0, high = 0;
    for (std::size_t k = 1; k + 1 < count; ++k) {
      const double miss = value(k) - first - (last - first) * double(k) / double(count - 1);
      low = std::min(low, miss);
      high = std::max(high, miss);
    }
    first += 0.5 * (low + high);
    last += 0.5 * (low + high);
    error = 0.5 * (high - low);
  }
};

} // namespace

struct QuadSums::Pixel {
  std::uint32_t texel;
  std::array<std::uint32_t, 4> node;
  double sr;
  std::array<double, kShares> share;
};

/// Segments of a strip, those of a quad together.
struct QuadSums::Strip {
  std::vector<Quad> quads; ///< slots are nodes here
  std::vector<Segment> segments;
};

/// The lines of a segment; false where the pixels do not follow them.
bool QuadSums::fit(std::span<const Pixel> pixels, double most_sr_error, double most_share_error, Segment& segment) {
  const std::size_t count = pixels.size();
  const int steps = std::max(static_cast<int>(count) - 1, 1);
  const FittedLine angle(count, [&](std::size_t k) { return pixels[k].sr; });
  segment.solid_angle_sr = static_cast<float>(angle.first);
  segment.solid_angle_step_sr = static_cast<float>((angle.last - angle.first) / steps);
  bool fits = angle.error <= most_sr_error;
  for (std::size_t s = 0; s < kShares; ++s) {
    const FittedLine line(count, [&](std::size_t k) { return pixels[k].share[s]; });
    const auto integer = [](double share, int one) {
      return static_cast<int>(std::lround(std::clamp(share, 0.0, 1.0) * one));
    };
    const int start = integer(line.first, kMost),
              step = (integer(line.last, kOne) - kStepsOfStart * start) / steps; // rounded towards the start: within
    segment.share[s] = {static_cast<std::int16_t>(start), static_cast<std::int16_t>(step)};
    fits = fits && line.error <= most_share_error && std::abs(step) <= kMost;
  }
  return fits;
}

/// As many of the first pixels as lie side by side between the same nodes and follow straight lines.
QuadSums::Segment QuadSums::first_segment(std::span<const Pixel> pixels, double most_sr_error,
                                          double most_share_error) {
  std::size_t count = 1;
  while (count < std::min(pixels.size(), kSegmentTexels) && pixels[count].texel == pixels[0].texel + count &&
         pixels[count].node == pixels[0].node)
    ++count;
  Segment s{};
  while (!fit(pixels.first(count), most_sr_error, most_share_error, s) && count > 1)
    --count;
  s.at = 3 * pixels[0].texel;
  s.lanes = static_cast<std::uint16_t>((1u << (3 * count)) - 1);
  s.count = static_cast<std::uint16_t>(count);
  return s;
}

QuadSums::Strip QuadSums::make_strip(const SkyGeometry& geometry, const SkyPartition& nodes, double largest_sr,
                                     double most_sr, std::span<const std::uint8_t> needed, std::size_t row) {
  const auto width = static_cast<std::size_t>(geometry.width()), height = static_cast<std::size_t>(geometry.height());
  const double most_sr_error = kMostAngleError * most_sr,
               most_share_error = kMostShift * std::sqrt(most_sr * nodes.size() / (4 * kPi));
  std::map<std::array<std::uint32_t, 4>, std::vector<Segment>> of_quad;
  std::vector<Pixel> pixels;
  for (std::size_t y = row; y < std::min(row + kStripRows, height); ++y) {
    pixels.clear();
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t texel = y * width + x;
      const auto sr = double(geometry.solid_angle_sr()[texel]);
      if (sr == 0 || sr > largest_sr)
        continue;
      if (const auto d = geometry.direction({double(x), double(y)})) {
        const SkyPartition::Quad q = nodes.quad(*d);
        if (!needed.empty() && std::ranges::none_of(q.node, [&](std::uint32_t n) { return needed[n] != 0; }))
          continue;
        pixels.push_back({static_cast<std::uint32_t>(texel), q.node, sr, {q.up, q.right_below, q.right_above}});
      }
    }
    for (std::span<const Pixel> rest(pixels); !rest.empty();) {
      const Segment first = first_segment(rest, most_sr_error, most_share_error);
      of_quad[rest[0].node].push_back(first);
      rest = rest.subspan(first.count);
    }
  }
  std::vector<const decltype(of_quad)::value_type*> order;
  for (const auto& entry : of_quad)
    order.push_back(&entry);
  std::ranges::stable_sort(order, {}, [&](const auto* entry) { return entry->second.front().at % (3 * width); });
  Strip strip;
  for (const auto* entry : order)
    for (std::span<const Segment> rest(entry->second); !rest.empty();) {
      const std::span<const Segment> first = rest.first(std::min(rest.size(), kSegmentsOfSum));
      strip.quads.push_back({entry->first, static_cast<std::uint32_t>(first.size())});
      strip.segments.insert(strip.segments.end(), first.begin(), first.end());
      rest = rest.subspan(first.size());
    }
  return strip;
}

QuadSums QuadSums::make(const SkyGeometry& geometry, const SkyPartition& nodes, double largest_sr,
                        std::span<const std::uint8_t> needed) {
  const std::size_t count = (static_cast<std::size_t>(geometry.height()) + kStripRows - 1) / kStripRows;
  const double most_sr = double(*std::ranges::max_element(geometry.solid_angle_sr()));
  std::vector<Strip> strips(count);
  parallel_for(std::size_t{0}, count, [&](std::size_t k) {
    strips[k] = make_strip(geometry, nodes, largest_sr, most_sr, needed, k * kStripRows);
  });
  QuadSums sums;
  for (std::size_t k = 0; k < count; ++k) {
    while (sums.part_.size() <= k * kParts / count)
      sums.part_.push_back({sums.quads_.size(), sums.segments_.size()});
    sums.quads_.insert(sums.quads_.end(), strips[k].quads.begin(), strips[k].quads.end());
    sums.segments_.insert(sums.segments_.end(), strips[k].segments.begin(), strips[k].segments.end());
    strips[k] = {};
  }
  sums.part_.push_back({sums.quads_.size(), sums.segments_.size()});
  sums.segments_.resize(sums.segments_.size() + kSegmentsAhead); // are looked at
  sums.first_slot_ = number_slots(static_cast<std::size_t>(nodes.size()), [&](const auto& visit) {
    for (std::size_t p = 0; p + 1 < sums.part_.size(); ++p)
      for (std::size_t q = sums.part_[p].quad; q < sums.part_[p + 1].quad; ++q)
        for (std::uint32_t& slot : sums.quads_[q].slot)
          visit(p, slot);
  });
  return sums;
}

/// Lanes are colours in turn. Sums of the left nodes are what the right ones leave of a band, in units of kUnit.
DAYLIT_ANY_WIDTH void QuadSums::add_quads(std::span<const Quad> quads, const Segment* segment, const float* texels,
                                          Lanes* sums) {
  constexpr auto one = static_cast<float>(kOne);
  for (const Quad& quad : quads) {
    Lanes all_below{}, all_above{}, right_b{}, right_a{};
    for (const Segment* const end = segment + quad.segments; segment != end; ++segment) {
      const Segment s = *segment;
      Lanes texel{};
      std::copy_n(texels + s.at, 3 * std::size_t{s.count}, texel.begin());
      for (std::size_t k = 0; k < kLanes; ++k) {
        const int place = static_cast<int>(k / 3);
        std::array<float, kShares> share;
        for (std::size_t l = 0; l < kShares; ++l)
          share[l] = static_cast<float>(kStepsOfStart * s.share[l].start + place * s.share[l].step);
        const float all = texel[k] * (s.solid_angle_step_sr * static_cast<float>(place) + s.solid_angle_sr),
                    above = all * share[up], below = all * one - above;
        all_below[k] += below;
        all_above[k] += above;
        right_b[k] += below * share[right_below];
        right_a[k] += above * share[right_above];
      }
    }
    for (std::size_t k = 0; k < kLanes; ++k) {
      // Rounding alone would go below zero.
      sums[quad.slot[0]][k] += std::max(all_below[k] * one - right_b[k], 0.0f);
      sums[quad.slot[1]][k] += std::max(right_b[k], 0.0f);
      sums[quad.slot[2]][k] += std::max(all_above[k] * one - right_a[k], 0.0f);
      sums[quad.slot[3]][k] += right_a[k];
    }
  }
}

DAYLIT_AVX512 void QuadSums::add_quads_avx512(std::span<const Quad> quads, const Segment* segment, const float* texels,
                                              Lanes* sums) {
  const __m512i place = _mm512_set_epi32(5, 4, 4, 4, 3, 3, 3, 2, 2, 2, 1, 1, 1, 0, 0, 0),
                start_and_place = _mm512_or_epi32(_mm512_slli_epi32(place, 16), _mm512_set1_epi32(kStepsOfStart));
  const __m512 steps = _mm512_cvtepi32_ps(place), one = _mm512_set1_ps(static_cast<float>(kOne)),
               zero = _mm512_setzero_ps();
  for (const Quad& quad : quads) {
    __m512 all_below = zero, all_above = zero, right_b = zero, right_a = zero;
    for (const Segment* const end = segment + quad.segments; segment != end; ++segment) {
      const auto* ahead = reinterpret_cast<const char*>(texels + segment[kSegmentsAhead].at);
      _mm_prefetch(ahead, _MM_HINT_T0);
      _mm_prefetch(ahead + 56, _MM_HINT_T0);
      const auto share = [&](Share s) __attribute__((always_inline)) DAYLIT_AVX512 {
        const __m512i line = _mm512_set1_epi32(std::bit_cast<int>(segment->share[s]));
        return _mm512_cvtepi32_ps(_mm512_madd_epi16(line, start_and_place));
      };
      const __m512 angle = _mm512_fmadd_ps(_mm512_set1_ps(segment->solid_angle_step_sr), steps,
                                           _mm512_set1_ps(segment->solid_angle_sr)),
                   all = _mm512_mul_ps(_mm512_maskz_loadu_ps(segment->lanes, texels + segment->at), angle),
                   above = _mm512_mul_ps(all, share(up)), below = _mm512_fmsub_ps(all, one, above);
      all_below = _mm512_add_ps(all_below, below);
      all_above = _mm512_add_ps(all_above, above);
      right_b = _mm512_fmadd_ps(below, share(right_below), right_b);
      right_a = _mm512_fmadd_ps(above, share(right_above), right_a);
    }
    const auto give = [&](std::size_t n, __m512 sum) __attribute__((always_inline)) DAYLIT_AVX512 {
      float* const to = sums[quad.slot[n]].data();
      _mm512_storeu_ps(to, _mm512_add_ps(_mm512_loadu_ps(to), sum));
    };
    // Rounding alone would go below zero.
    give(0, _mm512_max_ps(_mm512_fmsub_ps(all_below, one, right_b), zero));
    give(1, _mm512_max_ps(right_b, zero));
    give(2, _mm512_max_ps(_mm512_fmsub_ps(all_above, one, right_a), zero));
    give(3, right_a);
  }
}

void QuadSums::add_by(AddQuads kernel, const float* texels, std::span<std::array<double, 3>> sums) const {
  if (quads_.empty())
    return;
  std::vector<Lanes> of_slot(first_slot_.back(), Lanes{});
  parallel_for(std::size_t{0}, part_.size() - 1, [&](std::size_t p) {
    kernel(std::span(quads_).subspan(part_[p].quad, part_[p + 1].quad - part_[p].quad),
           segments_.data() + part_[p].segment, texels, of_slot.data());
  });
  for (std::size_t n = 0; n < sums.size(); ++n)
    for (std::size_t slot = first_slot_[n]; slot < first_slot_[n + 1]; ++slot)
      for (std::size_t k = 0; k < 3 * kSegmentTexels; ++k)
        sums[n][k % 3] += kUnit * static_cast<double>(of_slot[slot][k]);
}

void QuadSums::add(const float* texels, std::span<std::array<double, 3>> sums) const {
  // Baseline, AVX2, and two with AVX-512.
  add_by(usable_tile_kernels().size() >= 3 ? add_quads_avx512 : add_quads, texels, sums);
}

void QuadSums::add_portable(const float* texels, std::span<std::array<double, 3>> sums) const {
  add_by(add_quads, texels, sums);
}

} // namespace daylit::detail
