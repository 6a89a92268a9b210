#include "runtime/input/camera_pictures.h"

#include <cmath>
#include <utility>

namespace daylit {

Result<PhotographReader> PhotographReader::open(const std::string& response) {
  const auto curve = ResponseCurve::named(response);
  if (!curve)
    return curve.error();
  return PhotographReader(*curve);
}

Result<Photograph> PhotographReader::read(const CameraFrame& frame) const {
  if (frame.format == PixelFormat{Mosaic::rgb, 8} &&
      frame.bytes.size() == frame_bytes(frame.width_px, frame.height_px, frame.format))
    return Photograph{{}, {frame.width_px, frame.height_px, frame.bytes}, response_};
  auto picture = linear_picture(frame);
  if (!picture)
    return picture.error();
  if (frame.format.bits > 8) {
    for (Rgb& t : picture->texels)
      for (int c = 0; c < 3; ++c)
        t[c] = response_.exposure(t[c], c);
    return Photograph{std::move(*picture), {}, ResponseCurve::linear()};
  }
  Photograph photo{{}, {picture->width, picture->height, {}}, response_};
  photo.original.bytes.reserve(3 * picture->texels.size());
  for (const Rgb& t : picture->texels)
    for (int c = 0; c < 3; ++c)
      photo.original.bytes.push_back(static_cast<std::uint8_t>(std::lround(255 * t[c])));
  return photo;
}

Result<CameraSettings> camera_settings(const CameraConfig& config, const LensModel& lens,
                                       const std::vector<int>& exposures_us) {
  CameraSettings s;
  s.camera = config.camera;
  s.pixel_format = config.pixel_format;
  if (!config.mosaic.empty()) {
    const auto mosaic = mosaic_named(config.mosaic);
    if (!mosaic)
      return mosaic.error();
    s.mosaic = *mosaic;
  }
  s.exposure_us = config.exposure_us;
  s.exposures_us = exposures_us;
  s.gain = config.gain;
  s.frame_rate_hz = config.frame_rate_hz;
  s.packet_bytes = config.packet_bytes;
  const int width = config.width_px > 0 ? config.width_px : lens.width_px;
  const int height = config.width_px > 0 ? config.height_px : lens.height_px;
  if (width < 1 || height < 1)
    return Error{ErrorCode::value_invalid, "neither the lens file nor the configuration says how large the frames are",
                 "camera " + config.camera, "give size = [width, height]"};
  s.width_px = width;
  s.height_px = height;
  return s;
}

} // namespace daylit
