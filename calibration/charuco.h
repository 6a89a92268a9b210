#pragma once

// ChArUco boards in photographs: markers say which corner is which, so that a part of the board is enough.

#include "calibration/target.h"

namespace daylit::calibration {

/// The square, column and row, that marker `id` is printed in; `columns` squares in a row.
glm::ivec2 square_of_marker(int id, int columns, bool black_first);

/// See find_board(); `target` has a dictionary. At least kFewestCorners corners, or none.
Result<FoundBoard> find_charuco(const Rgb8Image& picture, const Target& target);

inline constexpr std::size_t kFewestCorners = 6;

} // namespace daylit::calibration
