#pragma once

// How far a composited picture is from the truth (docs/design.md, "picture error").

#include <optional>
#include <string>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "simulate/contact_error.h"

namespace daylit {

struct PictureErrorInput {
  RgbImage result;                         ///< the composite under test, linear
  RgbImage truth, room;                    ///< the same view with and without the object
  RgbImage coverage;                       ///< fraction of each pixel that the object covers in the truth
  std::optional<RgbImage> standard_error;  ///< of the truth
  std::optional<RgbImage> result_coverage; ///< the object in the result; without it the truth's mask stands for both
  std::optional<RgbImage> second_truth;    ///< of other random numbers: says which pixels are in shade, and how much of
                                           ///< a difference is the noise of the truth
};

/// Root mean square over pixels and channels of result - truth, divided by the mean of the truth over the same pixels.
struct RegionError {
  std::size_t pixels = 0;
  bool measured = false; ///< false: no pixel, or black ones; the numbers below say nothing
  double relative_rms = 0.0;
  double bias = 0.0;                 ///< mean(result - truth) / mean(truth)
  double no_object_rms = 0.0;        ///< what the unchanged picture would score
  double truth_standard_error = 0.0; ///< RMS of the truth's standard error / mean of the truth
  /// sqrt(mean((result - truth) (result - second truth))) / mean of the truth: the noises of the two truths are
  /// independent and fall out, what the result is off by stays. Only with a second truth.
  std::optional<double> rms_without_noise;
};

struct PictureError {
  RegionError object; ///< inside the mask of both pictures, eroded by 2 pixels
  RegionError shadow; ///< outside the mask dilated by 2 pixels, where the object changes the truth by more than 2 %
  /// The object's pixels as a picture shows them: both clipped at white, which is 1 / preview_exposure() of the room,
  /// and smoothed over those pixels (blur_within()).
  RegionError seen;
  RegionError shadow_seen; ///< the pixels of `shadow` in the same way: mirror images in the room too
  /// The darkest third of the object's pixels by luminance of the second truth. Chosen by the first, they would be
  /// those in which its noise is dark.
  std::optional<RegionError> shaded;
  ContactError contact; ///< beside the object, which the two above leave out
  RegionError whole;
  std::optional<double> mask_iou; ///< intersection over union of the masks; only with result_coverage
  double object_fraction = 0.0;   ///< of the picture
};

constexpr int kMaskErosion = 2, kMaskDilation = 2;
constexpr float kShadowChange = 0.02f;

/// Error: pictures of different sizes, a value that is not finite, no object pixel.
Result<PictureError> measure_picture_error(const PictureErrorInput& input);
std::string to_text(const PictureError& error);
std::string to_json(const PictureError& error);

/// Exposure that shows a linear picture well: its 98th percentile of luminance becomes 0.8.
float preview_exposure(const RgbImage& image);
/// |result - truth| in units of the truth's mean over the object, times `gain`; for looking at.
RgbImage difference_picture(const PictureErrorInput& input, float gain);

} // namespace daylit
