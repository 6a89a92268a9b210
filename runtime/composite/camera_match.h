#pragma once

// What the camera did to the photograph, done to what is drawn into it: its blur and its noise (Klein & Murray 2010
// match the imperfections of a webcam the same way). Pixels that the objects do not reach keep their bits.

#include <cstdint>

#include "runtime/composite/compose.h"
#include "scene/config/config.h"

namespace daylit {

/// Blurs objects, shadows and silhouettes, not the photograph behind them, whose blur is its own. `sigma_px`: standard
/// deviation of the point spread, pixels; 0 does nothing. Changes below `threshold` (ComposeSettings) stay unwritten.
/// `composite`: of this `photo`.
void match_blur(const PhotoPixels& photo, double sigma_px, float threshold, Composite& composite);

/// Adds what the photograph's own noise lacks where it is covered or darkened, so that every pixel has the deviation
/// that the camera gives its brightness. Normal deviates, independent per pixel and channel, the same for the same
/// `seed`; a pixel never becomes negative.
void match_noise(const PhotoPixels& photo, const CameraNoise& noise, std::uint64_t seed, Composite& composite);

} // namespace daylit
