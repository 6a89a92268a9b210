#pragma once

// Frames of the sky camera as radiance: one exposure each, or a bracket of several.

#include <memory>
#include <optional>
#include <vector>

#include "capture/frames/frame.h"
#include "capture/hdr/bracket_cycle.h"
#include "capture/hdr/lost_sun.h"
#include "scene/config/config.h"
#include "scene/core/result.h"
#include "scene/lens/fall_off.h"
#include "scene/sky/sky_image.h"

namespace daylit {

struct MeasuredSky {
  SkyImage sky;
  SkyBalance balance;
};

/// Radiance: [sky] white where a code value is the largest and was exposed for a millisecond; frames that state no
/// exposure count as one. A sun beyond the range is put back where [sky] illuminance is given.
class SkyReader {
public:
  /// Errors: of the lens, fall-off or response file, of the exposures.
  static Result<SkyReader> open(const SkyConfig& config);
  /// Frames have to come one after another, none left out.
  bool is_bracket() const { return !config_.exposures_us.empty(); }
  /// Nothing: the frame is a part of a bracket that its shortest exposure will complete. Errors: the frame is damaged,
  /// or of another size than the lens file's; which exposure is which cannot be told.
  Result<std::optional<MeasuredSky>> read(const CameraFrame& frame);

private:
  struct Exposed {
    RgbImage radiance;
    std::vector<std::uint8_t> over_range; ///< one per pixel
  };
  SkyReader(SkyConfig config, SkyProjection projection, FallOff fall_off, ResponseCurve response)
      : config_(std::move(config)), projection_(std::move(projection)), fall_off_(std::move(fall_off)),
        response_(std::move(response)) {}
  Result<void> prepare(int width_px, int height_px);
  Result<Exposed> one_exposure(const CameraFrame& frame) const;
  Result<std::optional<Exposed>> bracket(const CameraFrame& frame);
  Result<MeasuredSky> measured(Exposed exposed, std::int64_t time_ns) const;
  Result<double> reading() const;

  SkyConfig config_;
  SkyProjection projection_;
  FallOff fall_off_;
  ResponseCurve response_;
  std::optional<BracketCycle> cycle_;
  std::uint64_t frames_without_sky_ = 0;
  std::shared_ptr<const SkyGeometry> geometry_; ///< of the frames so far
  std::vector<float> sensitivity_;              ///< of their pixels; empty: alike everywhere
};

} // namespace daylit
