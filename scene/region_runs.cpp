// The runs of pixels from which a frame's radiances are summed, in the order of the picture.

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <tuple>

#include <tbb/parallel_for.h>

#include "scene/detail/tile_kernels.h"
#include "scene/sky_partition.h"

// GCC 12 warns about its own header (its bug 105593).
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC diagnostic ignored "-Wuninitialized"
#endif
#include <immintrin.h>

#define DAYLIT_AVX512 __attribute__((target("avx512f,avx512bw,avx512vl,avx512dq,avx2,fma,f16c")))

namespace daylit {

namespace {

constexpr double kFitError = 2e-3;             ///< of a texel, most that a run's straight line may be off
constexpr std::size_t kSumsOfStrips = 1 << 15; ///< sums of all strips together stay in the cache

/// What one texel gives to its regions, in the order of the regions; a texel of many takes several.
struct Texel {
  std::uint32_t at = 0;
  std::size_t slots = 0;
  std::array<std::uint32_t, 4> region{};
  std::array<double, 4> weight{};
  bool same_regions(const Texel& other) const { return slots == other.slots && region == other.region; }
  double total() const { return weight[0] + weight[1] + weight[2] + weight[3]; }
};

/// The line through the weights of [first, first + count) that keeps their sum: value at the first texel and slope.
std::pair<double, double> line_of(std::span<const Texel> texels, std::size_t slot) {
  const double n = static_cast<double>(texels.size());
  double sum = 0, moment = 0;
  for (std::size_t k = 0; k < texels.size(); ++k) {
    sum += texels[k].weight[slot];
    moment += (static_cast<double>(k) - 0.5 * (n - 1)) * texels[k].weight[slot];
  }
  const double slope = texels.size() < 2 ? 0.0 : moment / (n * (n * n - 1) / 12);
  return {sum / n - 0.5 * (n - 1) * slope, slope};
}

/// Whether straight lines are close to all weights.
bool fits(std::span<const Texel> texels) {
  for (std::size_t slot = 0; slot < texels.front().slots; ++slot) {
    const auto [value, slope] = line_of(texels, slot);
    for (std::size_t k = 0; k < texels.size(); ++k)
      if (std::abs(value + slope * static_cast<double>(k) - texels[k].weight[slot]) > kFitError * texels[k].total())
        return false;
  }
  return true;
}

} // namespace

/// Adds the runs of one row; `shares` are those of the row.
void RegionSums::add_row(std::size_t width, std::span<const Share> shares, std::size_t row, std::vector<Run>& runs) {
  std::vector<std::vector<std::pair<std::uint32_t, double>>> weights(width);
  for (const Share& s : shares)
    for (std::size_t k = s.first; k < std::size_t{s.first} + s.count; ++k)
      weights[k - row * width].emplace_back(s.region, s.weight);
  std::vector<Texel> line;
  const auto emit = [&](std::span<const Texel> texels, const auto& self) -> void {
    if (!fits(texels)) {
      self(texels.first(texels.size() / 2), self);
      self(texels.subspan(texels.size() / 2), self);
      return;
    }
    Run run{.first = texels.front().at,
            .count = static_cast<std::uint32_t>(texels.size()),
            .region = texels.front().region,
            .weight = {},
            .slope = {}};
    for (std::size_t slot = 0; slot < texels.front().slots; ++slot) {
      const auto [value, slope] = line_of(texels, slot);
      run.weight[slot] = static_cast<float>(value);
      run.slope[slot] = static_cast<float>(slope);
    }
    runs.push_back(run);
  };
  const auto end_line = [&] {
    if (!line.empty())
      emit(line, emit);
    line.clear();
  };
  for (std::size_t x = 0; x < width; ++x) {
    std::ranges::sort(weights[x]);
    for (std::size_t k = 0; k < weights[x].size(); k += kSlots) {
      Texel t{.at = static_cast<std::uint32_t>(row * width + x),
              .slots = std::min(kSlots, weights[x].size() - k),
              .region = {},
              .weight = {}};
      for (std::size_t i = 0; i < t.slots; ++i)
        std::tie(t.region[i], t.weight[i]) = weights[x][k + i];
      if (!line.empty() && !(line.back().same_regions(t) && line.back().at + 1 == t.at))
        end_line();
      line.push_back(t);
    }
  }
  end_line();
}

void RegionSums::make_runs(const std::vector<Share>& shares, std::size_t regions) {
  const auto width = static_cast<std::size_t>(geometry_->width()),
             height = static_cast<std::size_t>(geometry_->height());
  std::vector<std::vector<Share>> row_shares(height);
  for (const Share& s : shares)
    row_shares[s.first / width].push_back(s);
  std::vector<std::vector<Run>> rows(height);
  tbb::parallel_for(std::size_t{0}, height, [&](std::size_t y) { add_row(width, row_shares[y], y, rows[y]); });
  // The number of strips depends on the partition only: sums do not depend on the threads.
  const std::size_t strips = std::clamp<std::size_t>(kSumsOfStrips / std::max<std::size_t>(regions, 1), 2, 8);
  for (std::size_t y = 0; y < height; ++y) {
    while (strip_.size() <= y * strips / height)
      strip_.push_back(runs_.size());
    runs_.insert(runs_.end(), rows[y].begin(), rows[y].end());
  }
  strip_.push_back(runs_.size());
}

/// sums[region] += weight * solid angle * texel for the texels of the runs: four to a region, the last unused.
/// Reads four floats of each texel, so the last of the picture is left out.
void RegionSums::add_runs(std::span<const Run> runs, const float* solid_angle, const float* texels, double* sums) {
  for (const Run& run : runs) {
    __m128 slope[kSlots], weight[kSlots], sum[kSlots];
    for (std::size_t i = 0; i < kSlots; ++i) {
      slope[i] = _mm_set1_ps(run.slope[i]);
      weight[i] = _mm_set1_ps(run.weight[i]);
      sum[i] = _mm_setzero_ps();
    }
    for (std::size_t k = run.first; k < std::size_t{run.first} + run.count; ++k) {
      const __m128 light = _mm_mul_ps(_mm_set1_ps(solid_angle[k]), _mm_loadu_ps(texels + 3 * k));
      for (std::size_t i = 0; i < kSlots; ++i) {
        sum[i] = _mm_add_ps(sum[i], _mm_mul_ps(weight[i], light));
        weight[i] = _mm_add_ps(weight[i], slope[i]);
      }
    }
    for (std::size_t i = 0; i < kSlots; ++i) {
      double* const to = sums + 4 * std::size_t{run.region[i]};
      _mm_storeu_pd(to, _mm_add_pd(_mm_loadu_pd(to), _mm_cvtps_pd(sum[i])));
      _mm_storeu_pd(to + 2, _mm_add_pd(_mm_loadu_pd(to + 2), _mm_cvtps_pd(_mm_movehl_ps(sum[i], sum[i]))));
    }
  }
}

/// All four regions in one register.
DAYLIT_AVX512 void RegionSums::add_runs_avx512(std::span<const Run> runs, const float* solid_angle, const float* texels,
                                               double* sums) {
  const __m512i each = _mm512_set_epi32(3, 3, 3, 3, 2, 2, 2, 2, 1, 1, 1, 1, 0, 0, 0, 0);
  for (const Run& run : runs) {
    const __m512 slope = _mm512_permutexvar_ps(each, _mm512_castps128_ps512(_mm_loadu_ps(run.slope.data())));
    __m512 w0 = _mm512_permutexvar_ps(each, _mm512_castps128_ps512(_mm_loadu_ps(run.weight.data())));
    __m512 s0 = _mm512_setzero_ps(), s1 = s0, s2 = s0, s3 = s0;
    const float *at = texels + 3 * std::size_t{run.first}, *angle = solid_angle + run.first;
    std::uint32_t k = 0;
    if (run.count >= 8) {
      const __m512 two = _mm512_add_ps(slope, slope), four = _mm512_add_ps(two, two);
      __m512 w1 = _mm512_add_ps(w0, slope), w2 = _mm512_add_ps(w0, two), w3 = _mm512_add_ps(w1, two);
      for (; k + 4 <= run.count; k += 4, at += 12, angle += 4) {
        s0 = _mm512_fmadd_ps(_mm512_mul_ps(w0, _mm512_set1_ps(angle[0])), _mm512_broadcast_f32x4(_mm_loadu_ps(at)), s0);
        s1 = _mm512_fmadd_ps(_mm512_mul_ps(w1, _mm512_set1_ps(angle[1])), _mm512_broadcast_f32x4(_mm_loadu_ps(at + 3)),
                             s1);
        s2 = _mm512_fmadd_ps(_mm512_mul_ps(w2, _mm512_set1_ps(angle[2])), _mm512_broadcast_f32x4(_mm_loadu_ps(at + 6)),
                             s2);
        s3 = _mm512_fmadd_ps(_mm512_mul_ps(w3, _mm512_set1_ps(angle[3])), _mm512_broadcast_f32x4(_mm_loadu_ps(at + 9)),
                             s3);
        w0 = _mm512_add_ps(w0, four);
        w1 = _mm512_add_ps(w1, four);
        w2 = _mm512_add_ps(w2, four);
        w3 = _mm512_add_ps(w3, four);
      }
      s0 = _mm512_add_ps(_mm512_add_ps(s0, s1), _mm512_add_ps(s2, s3));
    }
    for (; k < run.count; ++k, at += 3, ++angle, w0 = _mm512_add_ps(w0, slope))
      s0 = _mm512_fmadd_ps(_mm512_mul_ps(w0, _mm512_set1_ps(*angle)), _mm512_broadcast_f32x4(_mm_loadu_ps(at)), s0);
    const __m128 slots[kSlots] = {_mm512_castps512_ps128(s0), _mm512_extractf32x4_ps(s0, 1),
                                  _mm512_extractf32x4_ps(s0, 2), _mm512_extractf32x4_ps(s0, 3)};
    for (std::size_t i = 0; i < kSlots; ++i) {
      double* const to = sums + 4 * std::size_t{run.region[i]};
      _mm256_storeu_pd(to, _mm256_add_pd(_mm256_loadu_pd(to), _mm256_cvtps_pd(slots[i])));
    }
  }
}

std::vector<Rgb> RegionSums::reduce(const SkyImage& sky) const {
  const std::vector<Rgb>& texels = sky.image().texels;
  const std::size_t regions = covered_.size(), strips = strip_.size() - 1;
  const std::vector<float>& solid_angle = geometry_->solid_angle_sr();
  // Baseline, AVX2, and two with AVX-512.
  const auto add = detail::usable_tile_kernels().size() >= 3 ? add_runs_avx512 : add_runs;
  std::vector<double> sums(strips * regions * 4, 0.0);
  tbb::parallel_for(std::size_t{0}, strips, [&](std::size_t s) {
    std::span<const Run> runs(runs_.data() + strip_[s], runs_.data() + strip_[s + 1]);
    double* const own = sums.data() + s * regions * 4;
    std::array<float, 8> last{};
    for (; !runs.empty() && runs.back().first + runs.back().count == texels.size();
         runs = runs.first(runs.size() - 1)) {
      Run whole = runs.back(), end = whole; // the last texel from a copy that may be read beyond
      --whole.count;
      for (std::size_t slot = 0; slot < kSlots; ++slot)
        end.weight[slot] += end.slope[slot] * static_cast<float>(whole.count);
      end.first = 0;
      end.count = 1;
      std::copy_n(&texels.back().r, 3, last.begin());
      add({&whole, 1}, solid_angle.data(), &texels[0].r, own);
      add({&end, 1}, &solid_angle.back(), last.data(), own);
    }
    add(runs, solid_angle.data(), texels.empty() ? nullptr : &texels[0].r, own);
  });
  std::vector<Rgb> mean(regions);
  for (std::size_t region = 0; region < regions; ++region) {
    glm::dvec3 sum{0.0};
    for (std::size_t s = 0; s < strips; ++s)
      for (int c = 0; c < 3; ++c)
        sum[c] += sums[(s * regions + region) * 4 + static_cast<std::size_t>(c)];
    const double total = solid_angle_.empty() ? covered_[region] + gap_[region] : solid_angle_[region];
    // A region smaller than a sub-pixel may have met no sample at all.
    mean[region] = total > 0 ? Rgb((sum + gap_[region] * glm::dvec3(sky.fill_radiance(centre_[region]))) / total)
                             : sky.radiance(centre_[region]);
  }
  return mean;
}

double RegionSums::covered_share(int region) const {
  const std::size_t r = static_cast<std::size_t>(region);
  const double total = covered_[r] + gap_[r];
  return total > 0 ? covered_[r] / total : 1.0;
}

} // namespace daylit
