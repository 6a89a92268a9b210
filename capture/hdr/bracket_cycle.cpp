#include "capture/hdr/bracket_cycle.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>

namespace daylit {

namespace {

constexpr double kLeastStep = 2.0; ///< between neighbouring exposures
constexpr double kAlike = 0.28;    ///< mean logarithmic difference of frames of one exposure: below 0.4 ln kLeastStep
constexpr float kMostDifferent = 1.4f; ///< what one block may add to it, so that a sun that moved does not decide
constexpr double kLeastLit = 0.1;      ///< of the blocks are taken to be lit in any case
constexpr int kBlocks = 64;            ///< across and down, at most
constexpr std::uint64_t kStale = 4;    ///< cycles without a frame of an exposure: learned anew
constexpr std::int64_t kSameMoment_ns = 5'000'000'000;
constexpr double kSameTime = 1.05; ///< ratio of times that a camera rounds to the same

Error bad_cycle(const std::string& what) {
  return {ErrorCode::value_invalid, what, "exposures", "give two or more, a factor of 2 or more apart"};
}

} // namespace

BracketCycle::BracketCycle(std::vector<double> times, MergeSettings settings)
    : times_(std::move(times)), settings_(std::move(settings)) {}

Result<BracketCycle> BracketCycle::create(std::vector<double> times, MergeSettings settings) {
  std::ranges::sort(times);
  if (times.size() < 2)
    return bad_cycle("one exposure is no bracket");
  if (!(times.front() > 0.0) || !std::isfinite(times.back()))
    return bad_cycle("an exposure time is not positive");
  for (std::size_t k = 1; k < times.size(); ++k)
    if (!(times[k] >= kLeastStep * times[k - 1]))
      return bad_cycle("two exposures differ by less than a factor of 2");
  return BracketCycle(std::move(times), std::move(settings));
}

std::vector<float> BracketCycle::block_means(const RgbImage& code) const {
  const int across = std::min(code.width, kBlocks), down = std::min(code.height, kBlocks);
  std::vector<float> sum(static_cast<std::size_t>(3 * across) * down), count(sum.size());
  for (int y = 0; y < code.height; ++y)
    for (int x = 0; x < code.width; ++x) {
      const std::size_t block = 3 * (static_cast<std::size_t>(y * down / code.height) * across +
                                     static_cast<std::size_t>(x * across / code.width));
      for (int c = 0; c < 3; ++c) {
        sum[block + c] += settings_.response.exposure(code.at(x, y)[c], c);
        count[block + c] += 1.0f;
      }
    }
  for (std::size_t i = 0; i < sum.size(); ++i)
    sum[i] /= count[i];
  return sum;
}

// Mean over the lit blocks of |ln((a + n) / (b + n))|, n = half the noise floor, which is what keeps the means of dark
// blocks from being exact.
double BracketCycle::difference(const std::vector<float>& a, const std::vector<float>& b) const {
  const float noise = settings_.response.exposure(static_cast<float>(0.5 * settings_.noise.floor), 1);
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (lit_[i])
      sum += static_cast<double>(std::min(std::abs(std::log((a[i] + noise) / (b[i] + noise))), kMostDifferent));
  const auto lit = static_cast<double>(std::ranges::count(lit_, std::uint8_t{1}));
  return sum / std::max(lit, kLeastLit * static_cast<double>(a.size()));
}

std::optional<std::size_t> BracketCycle::group_like(const std::vector<float>& block) const {
  std::optional<std::size_t> best;
  double least = kAlike;
  for (std::size_t g = 0; g < group_.size(); ++g)
    if (const double d = difference(group_[g].block, block); d < least) {
      least = d;
      best = g;
    }
  return best;
}

/// Known once as many groups as exposures have been seen twice: single frames of other exposures come while a camera
/// changes its settings.
void BracketCycle::learn(Group frame) {
  if (const auto g = group_like(frame.block)) {
    frame.seen = group_[*g].seen + 1;
    group_[*g] = std::move(frame);
  } else {
    group_.push_back(std::move(frame));
  }
  const auto once = [](const Group& g) { return g.seen < 2; };
  if (static_cast<std::size_t>(std::ranges::count_if(group_, once)) + times_.size() != group_.size())
    return;
  std::erase_if(group_, once);
  const auto brightness = [](const Group& g) { return std::accumulate(g.block.begin(), g.block.end(), 0.0); };
  std::ranges::sort(group_, {}, brightness);
  known_ = true;
}

void BracketCycle::forget_stale() {
  const auto stale = [&](const Group& g) { return report_.frames - g.last_frame > kStale * times_.size(); };
  if (!known_) {
    std::erase_if(group_, stale);
  } else if (std::ranges::any_of(group_, stale)) {
    group_.clear();
    known_ = false;
    ++report_.relearned;
  }
}

std::optional<double> BracketCycle::place(Group frame) {
  if (!known_) {
    const std::vector<float> block = frame.block;
    learn(std::move(frame));
    const auto g = known_ ? group_like(block) : std::nullopt;
    return g ? std::optional<double>(times_[*g]) : std::nullopt;
  }
  const auto g = group_like(frame.block);
  if (!g) {
    ++report_.unknown;
    return std::nullopt;
  }
  group_[*g] = std::move(frame);
  return times_[*g];
}

/// The camera says it: nothing has to be learned.
std::optional<double> BracketCycle::place_known(Group frame, double time) {
  if (group_.empty())
    group_.resize(times_.size());
  for (std::size_t k = 0; k < times_.size(); ++k)
    if (std::abs(std::log(time / times_[k])) < std::log(kSameTime)) {
      group_[k] = std::move(frame);
      known_ = std::ranges::all_of(group_, [](const Group& g) { return !g.code.empty(); });
      return times_[k];
    }
  ++report_.unknown;
  return std::nullopt;
}

Result<std::optional<double>> BracketCycle::add(RgbImage code, std::int64_t time_ns, std::optional<double> known_time) {
  if (width_ == 0) {
    width_ = code.width;
    height_ = code.height;
  }
  if (code.empty() || code.width != width_ || code.height != height_)
    return Error{ErrorCode::value_invalid, "the frame is not of the size of those before", "bracket",
                 "start a new bracket when the camera's settings change"};
  ++report_.frames;
  Group frame{std::move(code), {}, time_ns, 1, report_.frames};
  if (known_time)
    return place_known(std::move(frame), *known_time);
  frame.block = block_means(frame.code);
  lit_.resize(frame.block.size());
  for (std::size_t i = 0; i < lit_.size(); ++i)
    lit_[i] |= static_cast<double>(frame.block[i]) > 2 * settings_.noise.floor;
  forget_stale();
  return place(std::move(frame));
}

std::optional<BracketCycle::Merged> BracketCycle::merged() const {
  const auto other_moment = [&](const Group& g) {
    return std::abs(g.time_ns - group_.front().time_ns) > kSameMoment_ns;
  };
  if (!known_ || std::ranges::any_of(group_, other_moment))
    return std::nullopt;
  BracketMerger merger(width_, height_, settings_);
  for (std::size_t k = 0; k < times_.size(); ++k)
    if (!merger.add(group_[k].code, times_[k]))
      return std::nullopt;
  return Merged{merger.result(), group_.front().time_ns};
}

} // namespace daylit
