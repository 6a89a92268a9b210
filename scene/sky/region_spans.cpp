// The spans of pixels from which a frame's radiances are summed: a sparse matrix from pixels to regions in fixed point.

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "scene/core/parallel.h"
#include "scene/core/tile_kernels.h"
#include "scene/core/wide_vectors.h"
#include "scene/sky/quad_sums.h"
#include "scene/sky/sky_partition.h"
#include "scene/sky/slots.h"

#define DAYLIT_ANY_WIDTH __attribute__((target_clones("default", "arch=x86-64-v3")))

namespace daylit {

namespace {

// Rows of a picture that regions in turn look at again. They are often a multiple of 4 KB apart, so that neighbours
// share the sets of the first cache: more than eight rows do not stay there.
constexpr std::size_t kStripRows = 8;
constexpr std::size_t kParts = 8;           ///< for the threads; fixed, so that sums do not depend on their number
constexpr std::size_t kSpansOfFloats = 256; ///< as many are summed in float32, the sums of these in double
constexpr double kMostWeight = 65535;
constexpr std::size_t kSpansAhead = 64; ///< of the sums their texels are fetched: a strip is new to the cache

} // namespace

/// The texels of one strip with their regions, sorted by region, each region's by texel.
struct RegionSums::Strip {
  struct Texel {
    std::uint32_t at;
    std::uint16_t weight; ///< in steps
  };
  float step_sr = 0;
  std::vector<std::uint32_t> region;
  std::vector<std::vector<Texel>> texels; ///< of each of these regions
};

/// Weights are rounded so that those of one texel add up to its solid angle.
RegionSums::Strip RegionSums::make_strip(std::span<const Share> shares, std::span<const float> solid_angle_sr,
                                         std::size_t first, std::size_t regions) {
  Strip strip;
  const double most = static_cast<double>(*std::ranges::max_element(solid_angle_sr));
  strip.step_sr = static_cast<float>(most / kMostWeight);
  std::vector<double> given(solid_angle_sr.size(), 0.0); // to the regions before, steps
  std::vector<std::uint32_t> place(regions, 0);          // in strip.region, counted from 1
  for (const Share& s : shares)
    for (std::size_t at = s.first; at < std::size_t{s.first} + s.count; ++at) {
      double& sum = given[at - first];
      const double before = std::round(sum);
      sum += s.weight * static_cast<double>(solid_angle_sr[at - first]) / static_cast<double>(strip.step_sr);
      const double weight = std::min(std::round(sum), kMostWeight) - before;
      if (weight <= 0)
        continue;
      if (place[s.region] == 0) {
        strip.region.push_back(s.region);
        strip.texels.emplace_back();
        place[s.region] = static_cast<std::uint32_t>(strip.region.size());
      }
      strip.texels[place[s.region] - 1].push_back({static_cast<std::uint32_t>(at), static_cast<std::uint16_t>(weight)});
    }
  for (std::vector<Strip::Texel>& list : strip.texels)
    std::ranges::stable_sort(list, {}, &Strip::Texel::at);
  return strip;
}

/// Appends the spans of a strip, region by region from the left to the right of the picture.
void RegionSums::add_strip(const Strip& strip, std::size_t width) {
  std::vector<std::size_t> order(strip.region.size());
  for (std::size_t k = 0; k < order.size(); ++k)
    order[k] = k;
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return strip.texels[k].front().at % width; });
  const std::size_t last_start = std::max(texels(), kSpanTexels) - kSpanTexels;
  for (const std::size_t k : order) {
    std::size_t in_group = kSpansOfFloats;
    for (const Strip::Texel& texel : strip.texels[k]) {
      if (in_group == kSpansOfFloats || texel.at >= spans_.back().first + kSpanTexels) {
        if (in_group == kSpansOfFloats) {
          groups_.push_back({.slot = strip.region[k], .spans = 0, .step_sr = strip.step_sr});
          in_group = 0;
        }
        spans_.push_back({.first = std::min<std::uint32_t>(texel.at, static_cast<std::uint32_t>(last_start))});
        ++groups_.back().spans;
        ++in_group;
      }
      std::uint16_t& weight = spans_.back().weight[texel.at - spans_.back().first];
      weight = static_cast<std::uint16_t>(weight + texel.weight);
    }
  }
}

void RegionSums::make_spans(const std::vector<Share>& shares, std::size_t regions) {
  const auto width = static_cast<std::size_t>(geometry_->width()),
             height = static_cast<std::size_t>(geometry_->height());
  const std::size_t count = (height + kStripRows - 1) / kStripRows, strip_texels = kStripRows * width;
  std::vector<std::vector<Share>> of_strip(count);
  for (const Share& s : shares)
    of_strip[s.first / strip_texels].push_back(s);
  std::vector<Strip> strips(count);
  const std::span<const float> solid_angle(geometry_->solid_angle_sr());
  parallel_for(std::size_t{0}, count, [&](std::size_t k) {
    const std::size_t first = k * strip_texels;
    strips[k] =
        make_strip(of_strip[k], solid_angle.subspan(first, std::min(strip_texels, texels() - first)), first, regions);
  });
  for (std::size_t k = 0; k < count; ++k) {
    while (part_.size() <= k * kParts / count)
      part_.push_back({groups_.size(), spans_.size()});
    add_strip(strips[k], width);
  }
  part_.push_back({groups_.size(), spans_.size()});
  spans_.resize(spans_.size() + kSpansAhead); // are looked at, and vectors are loaded whole
  first_slot_ = detail::number_slots(regions, [&](const auto& visit) {
    for (std::size_t p = 0; p + 1 < part_.size(); ++p)
      for (std::size_t g = part_[p].group; g < part_[p + 1].group; ++g)
        visit(p, groups_[g].slot);
  });
}

/// What reduce() sums of a picture of ones, by the same weights: steradians.
void RegionSums::measure_sums(std::vector<double>& covered_sr) const {
  const std::vector<Rgb> ones(texels(), Rgb(1.0f));
  std::vector<std::array<double, 3>> sums(covered_sr.size());
  add_spans(ones, sums);
  if (quads_)
    quads_->add(&ones.front().r, sums);
  for (std::size_t r = 0; r < covered_sr.size(); ++r)
    covered_sr[r] = sums[r][0];
}

/// sums[slot] += step * sum of weight * texel for each group in turn; four numbers to a slot, the last unused.
DAYLIT_ANY_WIDTH void RegionSums::add_groups(std::span<const Group> groups, const Span* span, const float* texels,
                                             double* sums) {
  for (const Group& group : groups) {
    std::array<float, 3 * kSpanTexels> sum{}, weight;
    for (const Span* const end = span + group.spans; span != end; ++span) {
      for (std::size_t k = 0; k < weight.size(); ++k)
        weight[k] = static_cast<float>(span->weight[k / 3]);
      for (std::size_t k = 0; k < weight.size(); ++k)
        sum[k] += weight[k] * texels[3 * std::size_t{span->first} + k];
    }
    for (std::size_t k = 0; k < sum.size(); ++k)
      sums[4 * std::size_t{group.slot} + k % 3] += static_cast<double>(group.step_sr * sum[k]);
  }
}

/// Five texels to a register, so that all registers hold the colours in the same order.
DAYLIT_AVX512 void RegionSums::add_groups_avx512(std::span<const Group> groups, const Span* span, const float* texels,
                                                 double* sums) {
  constexpr __mmask16 kFive = 0x7fff;
  const __m512i low = _mm512_set_epi32(0, 4, 4, 4, 3, 3, 3, 2, 2, 2, 1, 1, 1, 0, 0, 0),
                high = _mm512_add_epi32(low, _mm512_set1_epi32(5)),
                six_on = _mm512_set_epi32(5, 4, 3, 2, 1, 0, 15, 14, 13, 12, 11, 10, 9, 8, 7, 6);
  for (const Group& group : groups) {
    __m512 a = _mm512_setzero_ps(), b = a, c = a, d = a;
    const auto add = [&](const Span& s, __m512& front, __m512& back) __attribute__((always_inline)) DAYLIT_AVX512 {
      const float* at = texels + 3 * std::size_t{s.first};
      const auto* ahead = reinterpret_cast<const char*>(texels + 3 * std::size_t{(&s)[kSpansAhead].first});
      _mm_prefetch(ahead, _MM_HINT_T0);
      _mm_prefetch(ahead + 64, _MM_HINT_T0);
      const __m512 weight = _mm512_cvtepi32_ps(
          _mm512_cvtepu16_epi32(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(s.weight.data()))));
      front = _mm512_fmadd_ps(_mm512_permutexvar_ps(low, weight), _mm512_loadu_ps(at), front);
      back = _mm512_fmadd_ps(_mm512_permutexvar_ps(high, weight), _mm512_maskz_loadu_ps(kFive, at + 15), back);
    };
    const Span* const end = span + group.spans;
    for (; span + 2 <= end; span += 2) {
      add(span[0], a, b);
      add(span[1], c, d);
    }
    if (span != end)
      add(*span++, a, b);
    // Lanes 0 to 5 and 6 to 11, then 12 to 14, then the two colours triples.
    const __m512 all = _mm512_add_ps(_mm512_add_ps(a, b), _mm512_add_ps(c, d)),
                 two = _mm512_add_ps(all, _mm512_permutexvar_ps(six_on, all));
    const __m128 sum =
        _mm_add_ps(_mm_add_ps(_mm512_castps512_ps128(two),
                              _mm512_castps512_ps128(_mm512_permutexvar_ps(
                                  _mm512_set_epi32(0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 3, 5, 4, 3), two))),
                   _mm512_extractf32x4_ps(all, 3));
    double* const to = sums + 4 * std::size_t{group.slot};
    _mm256_storeu_pd(to,
                     _mm256_add_pd(_mm256_loadu_pd(to), _mm256_cvtps_pd(_mm_mul_ps(_mm_set1_ps(group.step_sr), sum))));
  }
}

void RegionSums::add_spans(const std::vector<Rgb>& picture, std::span<std::array<double, 3>> region_sums) const {
  if (groups_.empty())
    return;
  std::vector<Rgb> padded;
  const std::vector<Rgb>* image = &picture;
  if (image->size() < kSpanTexels) {
    padded = *image;
    padded.resize(kSpanTexels, Rgb(0.0f));
    image = &padded;
  }
  const float* const texels = &image->front().r;
  // Baseline, AVX2, and two with AVX-512.
  const auto add = detail::usable_tile_kernels().size() >= 3 ? add_groups_avx512 : add_groups;
  std::vector<double> sums(std::size_t{4} * first_slot_.back(), 0.0);
  parallel_for(std::size_t{0}, part_.size() - 1, [&](std::size_t p) {
    add(std::span(groups_).subspan(part_[p].group, part_[p + 1].group - part_[p].group), spans_.data() + part_[p].span,
        texels, sums.data());
  });
  for (std::size_t region = 0; region < region_sums.size(); ++region)
    for (std::size_t slot = first_slot_[region]; slot < first_slot_[region + 1]; ++slot)
      for (std::size_t c = 0; c < 3; ++c)
        region_sums[region][c] += sums[4 * slot + c];
}

std::size_t RegionSums::bytes() const {
  return spans_.size() * sizeof(Span) + groups_.size() * sizeof(Group) + divisor_.size() * sizeof(Divisor) +
         (quads_ ? quads_->bytes() : 0);
}

std::vector<Rgb> RegionSums::reduce(const SkyImage& sky) const {
  std::vector<std::array<double, 3>> sums(covered_.size());
  add_spans(sky.image().texels, sums);
  if (quads_)
    quads_->add(&sky.image().texels.front().r, sums);
  const Rgb above = sky.sky_fill_radiance(), below = sky.fill_radiance();
  std::vector<Rgb> mean(covered_.size());
  for (std::size_t region = 0; region < mean.size(); ++region) {
    const std::array<double, 3>& sum = sums[region];
    const Divisor& d = divisor_[region];
    mean[region] = Rgb(static_cast<float>(sum[0] * d.per_sr), static_cast<float>(sum[1] * d.per_sr),
                       static_cast<float>(sum[2] * d.per_sr)) +
                   d.fill_above * above + d.fill_below * below;
  }
  for (const std::uint32_t region : unseen_)
    mean[region] = sky.radiance(centre_[region]);
  return mean;
}

double RegionSums::covered_share(int region) const {
  const std::size_t r = static_cast<std::size_t>(region);
  const double total = covered_[r] + gap_[r];
  return total > 0 ? covered_[r] / total : 1.0;
}

} // namespace daylit
