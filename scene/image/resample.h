#pragma once

#include "scene/image/rgb_image.h"

namespace daylit {

/// The picture with width_px x height_px pixels, both at least 1: each new pixel is the mean of the old picture over
/// its area (a box filter with partial pixels), so that the mean of the whole stays. Enlarged, pixels become squares.
RgbImage resampled_by_area(const RgbImage& image, int width_px, int height_px);

} // namespace daylit
