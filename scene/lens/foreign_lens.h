#pragma once

// Lens files of other programs, turned into the lens models here.

#include <string>

#include "scene/core/result.h"
#include "scene/lens/lens.h"

namespace daylit::detail {

/// Whether a file begins as the text that the OCamCalib toolbox exports (calib_results.txt).
bool is_ocam(const std::string& text);
/// Its polynomial (Scaramuzza, Martinelli & Siegwart 2006) as the equidistant model that is nearest to it, least
/// squares over the field: 90 degrees, or what a line `#max_theta_deg` and a number say. Error value_invalid: the two
/// differ by more than half a pixel somewhere; a damaged file.
Result<LensModel> parse_ocam(const std::string& text, const std::string& name);

/// Whether a file begins as a Radiance picture does.
bool is_radiance(const std::string& text);
/// The last VIEW= of a Radiance picture's header: -vta (angular fish-eye) and -vtv (perspective), with its size from
/// the picture's resolution line, and world_from_camera from -vd and -vu. Error value_invalid: another type of view, a
/// shifted or sliced view, no view.
Result<LensModel> parse_radiance_view(const std::string& header, const std::string& name);

} // namespace daylit::detail
