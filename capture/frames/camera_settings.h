#pragma once

#include "capture/frames/aravis_source.h"
#include "scene/config/config.h"

namespace daylit {

/// What [sky] or [interior] camera says, as a camera is opened with it. Pictures have the lens file's size
/// (`lens_width_px`, 0: as the camera has it) where `size` is not given. Error value_invalid: no such mosaic.
Result<CameraSettings> camera_settings(const CameraConfig& camera, int lens_width_px, int lens_height_px);

} // namespace daylit
