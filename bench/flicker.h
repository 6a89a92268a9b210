#pragma once

// How steady the picture is under a still sky whose every pixel carries fresh noise.

#include "bench/frame_scene.h"

namespace daylit::bench {

/// Standard deviation over frames, RMS over pixels, by the mean over the same pixels; green.
struct Flicker {
  double object = 0.0, shadow = 0.0;
};

/// `frames` of the scene's skies before its first photograph; pixels as the last frame has them.
Result<Flicker> measure_flicker(const FrameScene& scene, Session& session, int frames);

} // namespace daylit::bench
