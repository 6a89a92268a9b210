#include "calibration/target.h"

#include "calibration/charuco.h"

namespace daylit::calibration {

Result<FoundBoard> find_board(const Rgb8Image& picture, const Target& target) {
  if (!target.dictionary.empty())
    return find_charuco(picture, target);
  auto corners = find_checkerboard(picture, target.size);
  if (!corners)
    return FoundBoard{{}, {}, why_not_found(picture, target.size)};
  return FoundBoard{std::move(*corners), board_points(target.size.columns, target.size.rows, target.square_m), ""};
}

} // namespace daylit::calibration
