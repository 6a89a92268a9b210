#pragma once

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/lens/lens.h"

namespace daylit::calibration {

/// Integral of luminance times cosine over the half space before the lens: lx for a picture in cd m^-2.
double illuminance_at(const RgbImage& radiance, const LensModel& lens);

} // namespace daylit::calibration
