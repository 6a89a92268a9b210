#pragma once

// Whether the pictures of a board agree on one lens.

#include "calibration/lens_fit.h"

namespace daylit::calibration {

struct LensAgreement {
  /// F of the hypothesis that all views have one focal length and middle: what the sum of squared errors falls by when
  /// each view has its own (linearised at the fit, its pose following), for each of these numbers, over what is left
  /// for each degree of freedom. About 1 for one lens and independent corners; 0 where there are too few.
  double f = 0;
  double two = 0; ///< the part of that gain that two lenses would give, each for the views that it suits better
};

LensAgreement lens_agreement(const LensFit& fit, std::span<const BoardView> views);

/// Reasons against the result, each with what to do: corners far off; else pixels or a print that are longer one way,
/// and views of two lenses.
/// `alike`: the views are too much so to tell pixels from tilt.
std::vector<std::string> shape_faults(const LensFit& fit, const LensAgreement& agreement, bool alike);

} // namespace daylit::calibration
