#pragma once

// Markers in one picture.

#include <cstdint>
#include <string>
#include <vector>

#include "capture/markers/board.h"
#include "scene/config/config.h"
#include "scene/core/result.h"
#include "scene/image/image_formats.h"

namespace daylit {

/// Light ~ (code value)^exponent: of photographs and video (sRGB), and of a camera whose code values are linear.
constexpr double kPhotographExponent = 2.2, kLinearExponent = 1.0;

/// All markers of a dictionary, by id. Corners are where the sides of the black square cross, each fitted in linear
/// light to a few hundredths of a pixel on a clean picture. Error usage: unknown dictionary.
Result<std::vector<SeenMarker>> find_markers(const Rgb8Image& picture, const std::string& dictionary,
                                             double exponent = kPhotographExponent);

/// A marker as it is printed: cells row by row from the top left, its black border included.
struct MarkerPrint {
  int cells_per_side = 0;
  std::vector<std::uint8_t> white; ///< 1 = paper, 0 = ink
};

/// The print that SeenMarker::corner_px belong to. Error usage: unknown dictionary, or no such id in it.
Result<MarkerPrint> marker_print(const std::string& dictionary, int id);

/// The board of [marker]. Error value_invalid: several ids without columns, ids that do not fill rows, a dictionary or
/// an id that there is not.
Result<BoardLayout> board_of(const MarkerConfig& marker);

} // namespace daylit
