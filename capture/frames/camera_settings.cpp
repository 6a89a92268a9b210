#include "capture/frames/camera_settings.h"

namespace daylit {

Result<CameraSettings> camera_settings(const CameraConfig& camera, int lens_width_px, int lens_height_px) {
  CameraSettings s;
  s.camera = camera.camera;
  s.pixel_format = camera.pixel_format;
  s.exposure_us = camera.exposure_us;
  s.gain = camera.gain;
  s.frame_rate_hz = camera.frame_rate_hz;
  s.packet_bytes = camera.packet_bytes;
  const int width = camera.width_px > 0 ? camera.width_px : lens_width_px,
            height = camera.height_px > 0 ? camera.height_px : lens_height_px;
  if (width > 0 && height > 0)
    s.width_px = width, s.height_px = height;
  if (camera.mosaic.empty())
    return s;
  const auto mosaic = mosaic_named(camera.mosaic);
  if (!mosaic)
    return mosaic.error();
  s.mosaic = *mosaic;
  return s;
}

} // namespace daylit
