#include "calibration/target.h"

#include "calibration/charuco.h"

namespace daylit::calibration {

namespace {

Result<FoundBoard> find_plain(const Rgb8Image& picture, const Target& target) {
  auto corners = find_checkerboard(picture, target.size);
  if (!corners)
    return FoundBoard{{}, {}, why_not_found(picture, target.size)};
  return FoundBoard{std::move(*corners), board_points(target.size.columns, target.size.rows, target.square_m), ""};
}

} // namespace

Result<FoundBoard> find_board(const Rgb8Image& picture, const Target& target) {
  auto found = target.dictionary.empty() ? find_plain(picture, target) : find_charuco(picture, target);
  if (found && !found->corner_px.empty())
    found->white_is_lost = white_is_lost(picture, found->corner_px);
  return found;
}

} // namespace daylit::calibration
