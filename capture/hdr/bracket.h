#pragma once

// One HDR picture from several exposures.

#include <cstdint>
#include <vector>

#include "capture/hdr/response_curve.h"
#include "scene/core/result.h"
#include "scene/image/rgb_image.h"

namespace daylit {

/// Noise of a code value v (both as fractions of the largest code): its variance is floor^2 + photon v (EMVA 1288).
struct CodeNoise {
  double floor = 0.0;  ///< deviation of black: read noise and rounding
  double photon = 0.0; ///< variance per value: 1 / electrons of a full pixel
  double variance(double v) const { return floor * floor + photon * v; }
};

/// What a camera of so many bits has when nothing better is known: rounding and read noise of half a code, but not
/// below 1/20,000 of the range, and a full well of 20,000 electrons. 8 bits: one code, for what JPEG adds.
CodeNoise usual_noise(int bits);

struct MergeSettings {
  ResponseCurve response = ResponseCurve::linear();
  CodeNoise noise = usual_noise(8);
  float saturated = 0.98f; ///< fraction of the largest code from which a sample is not trusted
};

struct MergedBracket {
  RgbImage radiance;            ///< exposure / exposure time
  std::uint64_t over_range = 0; ///< pixels saturated in the shortest exposure: their radiance is only known from below
  std::uint64_t ghosts = 0;     ///< pixels at which a longer exposure saw something else: it was not used there
  std::vector<std::uint8_t> over_range_mask; ///< one per pixel
};

/// Merges exposures one after another, from the shortest to the longest, so that one picture is in memory at a time.
///
/// A sample counts with the inverse of its variance (Granados et al. 2010, for known noise); saturated samples and
/// their neighbours do not count. What moved is shown as the shortest exposure saw it: a longer one counts at a pixel
/// only where it agrees with the exposures before it within their noise, and a pixel at which it should have been
/// saturated and is not, or the reverse, does not agree. So a sun that moved stands once in the result, with all of its
/// energy.
class BracketMerger {
public:
  BracketMerger(int width_px, int height_px, MergeSettings settings);

  /// `code`: code values as fractions of the largest; `time`: exposure time in any unit, not shorter than the one
  /// before. Pixels set in `ignored` (empty: none) hold no picture. Error value_invalid: another size, or a time that
  /// is not positive or shorter than the one before.
  Result<void> add(const RgbImage& code, double time, const std::vector<std::uint8_t>& ignored = {});
  /// Empty radiance before the first picture.
  MergedBracket result() const;

private:
  struct Sums {
    Rgb weighted{0.0f}, weight{0.0f}; ///< of radiance, and the inverse variance
  };
  void add_row(const RgbImage& code, double time, int y, const std::vector<std::uint8_t>& ignored,
               const std::vector<std::uint8_t>& saturated);
  Rgb variance_of(const Rgb& code, float per_time) const;
  bool too_bright(const Sums& before, const Rgb& code, float per_time) const;
  bool agrees(const Sums& before, const Rgb& radiance, const Rgb& variance) const;

  int width_, height_;
  MergeSettings settings_;
  Rgb foot_{0.0f}; ///< exposure that one noise floor above black stands for
  double last_time_ = 0.0;
  std::vector<Sums> sums_;
  std::vector<std::uint8_t> over_range_, ghost_;
};

} // namespace daylit
