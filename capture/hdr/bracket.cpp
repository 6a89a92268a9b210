#include "capture/hdr/bracket.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "scene/core/parallel.h"

namespace daylit {

namespace {

constexpr float kSigmas = 5.0f;     ///< beyond, two exposures saw different things
constexpr float kTolerance = 0.08f; ///< of the radiance: error of response and exposure times
constexpr int kRowGrain = 16;

bool is_saturated(const Rgb& code, float from) { return std::max({code.r, code.g, code.b}) >= from; }

/// Pixels that are saturated, or beside one that is: demosaicing and blooming carry it over.
std::vector<std::uint8_t> widened_saturation(const RgbImage& code, float from) {
  const int w = code.width, h = code.height;
  std::vector<std::uint8_t> mask(code.texels.size()), wide(code.texels.size());
  parallel_for(0, h, [&](int y) {
    for (int x = 0; x < w; ++x)
      mask[static_cast<std::size_t>(y) * w + x] = is_saturated(code.at(x, y), from);
  });
  parallel_for(0, h, [&](int y) {
    for (int x = 0; x < w; ++x) {
      std::uint8_t any = 0;
      for (int v = std::max(y - 1, 0); v <= std::min(y + 1, h - 1); ++v)
        for (int u = std::max(x - 1, 0); u <= std::min(x + 1, w - 1); ++u)
          any |= mask[static_cast<std::size_t>(v) * w + u];
      wide[static_cast<std::size_t>(y) * w + x] = any;
    }
  });
  return wide;
}

} // namespace

CodeNoise usual_noise(int bits) {
  const double code = 1.0 / ((1 << bits) - 1);
  return {bits <= 8 ? code : std::max(0.5 * code, 1.0 / 20000), 1.0 / 20000};
}

BracketMerger::BracketMerger(int width_px, int height_px, MergeSettings settings)
    : width_(width_px), height_(height_px), settings_(std::move(settings)) {
  for (int c = 0; c < 3; ++c)
    foot_[c] = settings_.response.exposure(settings_.response.black(c) + static_cast<float>(settings_.noise.floor), c);
}

Result<void> BracketMerger::add(const RgbImage& code, double time, const std::vector<std::uint8_t>& ignored) {
  if (code.width != width_ || code.height != height_)
    return Error{ErrorCode::value_invalid,
                 "is " + std::to_string(code.width) + " x " + std::to_string(code.height) + " pixels, not " +
                     std::to_string(width_) + " x " + std::to_string(height_),
                 "exposure", "all exposures of a bracket come from one camera"};
  if (!(time > 0.0) || !std::isfinite(time) || time < last_time_)
    return Error{ErrorCode::value_invalid, "the exposure time is not positive, or shorter than the one before",
                 "exposure", "give the exposures from the shortest to the longest"};
  last_time_ = time;
  if (sums_.empty()) {
    sums_.resize(code.texels.size());
    over_range_.resize(code.texels.size());
    ghost_.resize(code.texels.size());
  }
  const std::vector<std::uint8_t> saturated = widened_saturation(code, settings_.saturated);
  parallel_for(tbb::blocked_range<int>(0, height_, kRowGrain), [&](const tbb::blocked_range<int>& rows) {
    for (int y = rows.begin(); y < rows.end(); ++y)
      add_row(code, time, y, ignored, saturated);
  });
  return {};
}

// Whether two exposures saw the same: their difference against the deviation of the difference, in every channel.
bool BracketMerger::agrees(const Sums& before, const Rgb& radiance, const Rgb& variance) const {
  for (int c = 0; c < 3; ++c) {
    const float mean = before.weighted[c] / before.weight[c];
    const float deviation = std::sqrt(1.0f / before.weight[c] + variance[c]);
    if (std::abs(radiance[c] - mean) > kSigmas * deviation + kTolerance * std::max(mean, radiance[c]))
      return false;
  }
  return true;
}

// Radiance f(v) / t of code v. Its variance is that of the code through the slope of the response, plus the square of
// the exposure that the noise floor stands for: at the foot of the curve a code says no more than "at most".
Rgb BracketMerger::variance_of(const Rgb& code, float per_time) const {
  Rgb variance;
  for (int c = 0; c < 3; ++c) {
    const float slope = settings_.response.slope(code[c], c);
    const auto noise = static_cast<float>(settings_.noise.variance(std::max(code[c], 0.0f)));
    variance[c] = per_time * per_time * (slope * slope * noise + foot_[c] * foot_[c]);
  }
  return variance;
}

/// Whether a saturated sample is brighter than what was seen before allows.
bool BracketMerger::too_bright(const Sums& before, const Rgb& code, float per_time) const {
  for (int c = 0; c < 3; ++c) {
    const float least = settings_.response.exposure(settings_.saturated, c) * per_time;
    const float most = before.weighted[c] / before.weight[c] + kSigmas / std::sqrt(before.weight[c]);
    if (code[c] >= settings_.saturated && most < (1.0f - kTolerance) * least)
      return true;
  }
  return false;
}

void BracketMerger::add_row(const RgbImage& code, double time, int y, const std::vector<std::uint8_t>& ignored,
                            const std::vector<std::uint8_t>& saturated) {
  const auto per_time = static_cast<float>(1.0 / time);
  for (int x = 0; x < width_; ++x) {
    const std::size_t i = static_cast<std::size_t>(y) * width_ + x;
    if (!ignored.empty() && ignored[i])
      continue;
    const Rgb& v = code.texels[i];
    Sums& sums = sums_[i];
    const bool first = sums.weight.g == 0.0f;
    if (first)
      over_range_[i] = is_saturated(v, settings_.saturated);
    else if (saturated[i]) { // a neighbour of a saturated pixel says nothing, the pixel itself "at least this much"
      ghost_[i] |= too_bright(sums, v, per_time);
      continue;
    }
    Rgb radiance;
    for (int c = 0; c < 3; ++c)
      radiance[c] = settings_.response.exposure(v[c], c) * per_time;
    const Rgb variance = variance_of(v, per_time);
    if (!first && !agrees(sums, radiance, variance)) {
      ghost_[i] = 1;
      continue;
    }
    sums.weighted += radiance / variance;
    sums.weight += 1.0f / variance;
  }
}

MergedBracket BracketMerger::result() const {
  MergedBracket merged;
  if (sums_.empty())
    return merged;
  merged.radiance = RgbImage(width_, height_);
  for (std::size_t i = 0; i < sums_.size(); ++i)
    merged.radiance.texels[i] = sums_[i].weight.g > 0.0f ? sums_[i].weighted / sums_[i].weight : Rgb(0.0f);
  merged.over_range = static_cast<std::uint64_t>(std::ranges::count(over_range_, std::uint8_t{1}));
  merged.ghosts = static_cast<std::uint64_t>(std::ranges::count(ghost_, std::uint8_t{1}));
  merged.over_range_mask = over_range_;
  return merged;
}

} // namespace daylit
