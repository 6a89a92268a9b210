#pragma once

// The interior picture as linear radiance (in the camera's own scale), and back to the bytes it came from.

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "capture/hdr/response_curve.h"
#include "capture/markers/board.h"
#include "runtime/base/photo_pixels.h"
#include "scene/core/result.h"
#include "scene/image/image_formats.h"
#include "scene/image/rgb_image.h"

namespace daylit {

/// Either linear, or 8-bit code values and the response that makes them linear.
struct Photograph {
  RgbImage linear;    ///< of an EXR or .hdr; else empty
  Rgb8Image original; ///< bytes as stored; empty for an EXR or .hdr
  ResponseCurve response;

  bool is_hdr() const { return original.bytes.empty(); }
  /// Through the response backwards.
  PhotoPixels pixels() const { return is_hdr() ? PhotoPixels(linear) : PhotoPixels(original, response.table()); }
  /// A channel is at the top of its range: its radiance is only known from below.
  bool is_saturated(std::size_t pixel) const;
  std::size_t saturated_pixels() const;
};

/// EXR or Radiance .hdr (response must be "linear"), PNG or JPEG. NaN or infinite pixels of an EXR are an Error.
Result<Photograph> read_photograph(const std::filesystem::path& path, const std::string& response);

/// 8-bit code values of a linear picture.
Rgb8Image encode_picture(const ResponseCurve& response, const RgbImage& picture);
/// The changed picture in the photograph's own 8-bit code values. Pixels with touched == 0 keep their bytes. For a
/// photograph without bytes (EXR) all pixels go through the response. Error value_invalid: other sizes.
Result<Rgb8Image> encode_photograph(const Photograph& photo, const RgbImage& changed,
                                    const std::vector<std::uint8_t>& touched);

/// The picture for finding markers in: the original bytes, or an EXR exposed so that a luminance is white; 0: its 95th
/// percentile.
Rgb8Image marker_search_image(const Photograph& photo, float white = 0);
/// Largest luminance around markers: exposed for it, no edge of theirs moves because its bright side is clipped. 0:
/// none is seen, or the photograph has bytes.
float white_around(const Photograph& photo, const std::vector<SeenMarker>& seen);
/// marker_search_image(), exposed for those markers of the dictionary that are found at first. Error: of
/// find_markers().
Result<Rgb8Image> picture_of_markers(const Photograph& photo, const std::string& dictionary);
/// Its curve, light ~ (code value)^exponent, for find_markers(): 1 for bytes of response "linear".
double marker_search_exponent(const Photograph& photo, const std::string& response);

/// Median linear RGB of the paper just around a marker: a ring outside its black square (corners as in SeenMarker).
/// Errors (value_invalid): saturated, outside the picture, or not brighter than the black of the square.
Result<Rgb> marker_white(const Photograph& photo, const std::array<glm::dvec2, 4>& corner_px);

} // namespace daylit
