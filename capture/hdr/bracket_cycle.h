#pragma once

// A camera that cycles through exposures, merged as its frames come.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "capture/hdr/bracket.h"

namespace daylit {

struct CycleReport {
  std::uint64_t frames = 0;
  std::uint64_t unknown = 0;   ///< frames that look like none of the exposures, once these are known: not used
  std::uint64_t relearned = 0; ///< times that the exposures had to be found out again
};

/// Keeps the newest frame of each exposure. Which exposure a frame was taken with is found out from its pixels, because
/// cameras apply a setting some frames after it was asked for: frames of one exposure look alike from cycle to cycle,
/// those of different exposures do not, and a longer exposure is brighter. Every exposure has to be seen twice first.
/// Not known while two exposures look alike: both black, or both white.
class BracketCycle {
public:
  /// Exposure times in any unit, in any order. Error value_invalid: fewer than two, not positive, or two that differ by
  /// less than a factor of 2.
  static Result<BracketCycle> create(std::vector<double> times, MergeSettings settings);

  /// The next frame of the camera: codes as fractions of the largest. `known_time`: its exposure time where the camera
  /// says it with each frame itself (all frames, or none). Returns the exposure time it was taken with; nothing while
  /// that is not known, or when it is none of the cycle's. Error value_invalid: its size is not that of the frames
  /// before.
  Result<std::optional<double>> add(RgbImage code, std::int64_t time_ns,
                                    std::optional<double> known_time = std::nullopt);

  struct Merged {
    MergedBracket bracket;
    std::int64_t time_ns = 0; ///< of the shortest exposure: what moves is shown as it was then
  };
  /// Of the newest frame of each exposure; nothing until there is one of each, no more than 5 seconds from the
  /// shortest.
  std::optional<Merged> merged() const;
  const CycleReport& report() const { return report_; }

private:
  /// Frames of one exposure: the newest of them.
  struct Group {
    RgbImage code;
    std::vector<float> block; ///< mean exposure of each channel in blocks of the picture
    std::int64_t time_ns = 0;
    int seen = 0;
    std::uint64_t last_frame = 0;
  };
  BracketCycle(std::vector<double> times, MergeSettings settings);
  std::vector<float> block_means(const RgbImage& code) const;
  double difference(const std::vector<float>& a, const std::vector<float>& b) const;
  std::optional<std::size_t> group_like(const std::vector<float>& block) const;
  std::optional<double> place(Group frame);
  std::optional<double> place_known(Group frame, double time);
  void learn(Group frame);
  void forget_stale();

  std::vector<double> times_; ///< ascending
  MergeSettings settings_;
  std::vector<Group> group_; ///< once known_: one per exposure time, in their order
  bool known_ = false;
  std::vector<std::uint8_t> lit_; ///< blocks that were ever brighter than noise
  int width_ = 0, height_ = 0;
  CycleReport report_;
};

} // namespace daylit
