#pragma once

// The response of a camera from an exposure bracket.

#include <array>
#include <span>
#include <vector>

#include "calibration/bracket_files.h"
#include "capture/hdr/response_curve.h"
#include "scene/core/result.h"

namespace daylit::calibration {

enum class ResponseMethod {
  debevec,   ///< Debevec & Malik 1997: least squares for the logarithm of the exposure, smooth
  robertson, ///< Robertson, Borman, Stevenson 2003: most likely curve, alternating with the radiances
};

struct ResponseFit {
  ResponseCurve curve;              ///< monotone
  double residual = 0.0;            ///< rms relative error of exposures beside the radiance of their place
  double held_out = 0.0;            ///< the same at places that had no part in the fit
  std::vector<double> stated_ratio; ///< of each picture: its measured exposure over the stated one; 0: not known
  double fall = 0.0;                ///< largest relative fall of the raw curve, taken out to make it monotone
  double linear_deviation = 0.0;    ///< rms relative distance from a straight line through zero, 5 to 95 % of the codes
  int lowest_code = 0, highest_code = 255; ///< range in which every channel has samples
};

/// `pictures` from one camera position, two different times at least. `channels_alike`: one curve for all channels, as
/// a sensor has it before colours are processed. Error value_invalid: places that are well exposed
/// in two pictures are too few.
Result<ResponseFit> fit_response(std::span<const PlaceCodes> pictures, ResponseMethod method, bool channels_alike);

} // namespace daylit::calibration
