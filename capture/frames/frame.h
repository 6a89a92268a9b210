#pragma once

// One frame as a camera sent it, bit for bit, and what is known about it.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"

namespace daylit {

/// Which colour each sample is of: the first two pixels of the first two rows for the four Bayer mosaics.
enum class Mosaic { mono, rgb, rggb, grbg, gbrg, bggr };

struct PixelFormat {
  Mosaic mosaic = Mosaic::mono;
  int bits = 8; ///< significant bits of a sample, 8 to 16, in the low bits; more than 8: two bytes, low byte first
  int samples_per_pixel() const { return mosaic == Mosaic::rgb ? 3 : 1; }
  int bytes_per_sample() const { return bits > 8 ? 2 : 1; }
  bool operator==(const PixelFormat&) const = default;
};

/// "mono", "rgb", "rggb", ...: as in recordings and options. Error value_invalid: another word.
std::string name_of(Mosaic mosaic);
Result<Mosaic> mosaic_named(const std::string& name);

struct CameraFrame {
  int width_px = 0, height_px = 0;
  PixelFormat format;
  std::vector<std::uint8_t> bytes; ///< row by row without padding, frame_bytes() of them
  std::uint64_t id = 0;            ///< the camera's counter; gaps are lost frames
  std::int64_t time_ns = 0;        ///< when it reached this machine, UTC nanoseconds since 1970
  double exposure_us = 0.0;        ///< as set when it was taken; 0: not known
  /// When the camera took it, on this machine's clock that never jumps (std::chrono::steady_clock); 0: a recorded one.
  std::int64_t taken_ns = 0;
  bool operator==(const CameraFrame&) const = default;
};

/// Bytes that a frame of this size has.
std::size_t frame_bytes(int width_px, int height_px, const PixelFormat& format);

/// Linear RGB, 1 = the largest code value; a mosaic is filled in by an edge-aware method. Mono: three equal channels.
/// Takes the code values as linear. Error value_invalid: the number of bytes does not fit the size, or a mosaic smaller
/// than 3 x 3.
Result<RgbImage> linear_picture(const CameraFrame& frame);

} // namespace daylit
