#pragma once

// The interior picture as linear radiance (in the camera's own scale), and back to the bytes it came from.

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "runtime/base/photo_pixels.h"
#include "scene/core/result.h"
#include "scene/image/image_formats.h"
#include "scene/image/rgb_image.h"

namespace daylit {

/// 8-bit code values and the linear exposure they stand for, per channel; code 255 stands for 1. Rises strictly
/// between the first and the last code that differ from black and white.
class CameraResponse {
public:
  static CameraResponse linear();
  static CameraResponse srgb();
  /// Text: 256 lines, code 0 first, each with one number (all channels) or three (R G B): the linear exposure of that
  /// code in any unit, never falling. '#' starts a comment. Scaled so that code 255 is 1.
  static Result<CameraResponse> parse(const std::string& text, const std::string& name);
  /// "linear", "srgb", or the path of such a file.
  static Result<CameraResponse> named(const std::string& name);

  float decode(std::uint8_t code, int channel) const { return exposure_[static_cast<std::size_t>(channel)][code]; }
  Rgb decode(const std::uint8_t* rgb) const { return {decode(rgb[0], 0), decode(rgb[1], 1), decode(rgb[2], 2)}; }
  /// Code whose point on the curve is nearest: the curve between two codes is taken as straight, the border halfway.
  std::uint8_t encode(float linear, int channel) const;
  const ExposureTable& exposure() const { return exposure_; }

private:
  ExposureTable exposure_{};
};

/// Either linear, or 8-bit code values and the response that makes them linear.
struct Photograph {
  RgbImage linear;    ///< of an EXR or .hdr; else empty
  Rgb8Image original; ///< bytes as stored; empty for an EXR or .hdr
  CameraResponse response;

  bool is_hdr() const { return original.bytes.empty(); }
  /// Through the response backwards.
  PhotoPixels pixels() const { return is_hdr() ? PhotoPixels(linear) : PhotoPixels(original, response.exposure()); }
  /// A channel is at the top of its range: its radiance is only known from below.
  bool is_saturated(std::size_t pixel) const;
  std::size_t saturated_pixels() const;
};

/// EXR or Radiance .hdr (response must be "linear"), PNG or JPEG. NaN or infinite pixels of an EXR are an Error.
Result<Photograph> read_photograph(const std::filesystem::path& path, const std::string& response);

/// 8-bit code values of a linear picture.
Rgb8Image encode_picture(const CameraResponse& response, const RgbImage& picture);
/// The changed picture in the photograph's own 8-bit code values. Pixels with touched == 0 keep their bytes. For a
/// photograph without bytes (EXR) all pixels go through the response. Error value_invalid: other sizes.
Result<Rgb8Image> encode_photograph(const Photograph& photo, const RgbImage& changed,
                                    const std::vector<std::uint8_t>& touched);

/// The picture for finding markers in: the original bytes, or an EXR exposed so that its 95th percentile is white.
Rgb8Image marker_search_image(const Photograph& photo);
/// Its curve, light ~ (code value)^exponent, for find_markers(): 1 for bytes of response "linear".
double marker_search_exponent(const Photograph& photo, const std::string& response);

/// Median linear RGB of the paper just around a marker: a ring outside its black square (corners as in SeenMarker).
/// Errors (value_invalid): saturated, outside the picture, or not brighter than the black of the square.
Result<Rgb> marker_white(const Photograph& photo, const std::array<glm::dvec2, 4>& corner_px);

} // namespace daylit
