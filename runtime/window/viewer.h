#pragma once

#include <functional>

#include "runtime/session/session.h"
#include "scene/image/image_formats.h"

namespace daylit {

/// Shows the augmented picture in a window and lets the user turn the camera, drag objects and switch parts of the
/// light, until the window is closed or `most_frames` were drawn (0: no end). `encode`: picture to what is
/// shown. Away from the photograph's pose the room's model stands for it. Error: of the window or the session.
Result<void> run_viewer(Session& session, const RunConfig& config, const SkyImage& sky, const RgbImage& photo,
                        const std::function<Rgb8Image(const RgbImage&)>& encode, int most_frames);

} // namespace daylit
