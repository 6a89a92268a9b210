#pragma once

// What a sensor makes of light: blur, noise and codes.

#include <cstdint>

#include "scene/config/config.h"
#include "scene/image/image_formats.h"
#include "scene/image/rgb_image.h"

namespace daylit {

/// Gaussian of this standard deviation, pixels, along both axes; 0: nothing.
void blur(RgbImage& light, double sigma_px);

/// Adds the noise of a sensor to linear values (1: full), each channel by itself; not clipped. The same seed, the same
/// noise, for any number of threads.
void add_noise(RgbImage& light, const CameraNoise& noise, std::uint32_t seed);

} // namespace daylit
