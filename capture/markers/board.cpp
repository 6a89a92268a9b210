#include "capture/markers/board.h"

namespace daylit {

BoardLayout BoardLayout::single(const std::string& dictionary, int id, double side_m) {
  return {dictionary, {{id, side_m, {0.0, 0.0}}}};
}

Result<BoardLayout> BoardLayout::grid(const std::string& dictionary, const std::vector<int>& ids, int columns,
                                      double side_m, double gap_m) {
  if (columns < 1 || ids.empty() || ids.size() % static_cast<std::size_t>(columns) != 0 || !(gap_m >= 0))
    return Error{ErrorCode::value_invalid, "the ids do not fill whole rows of the board", "[marker]",
                 "give columns x rows ids"};
  const int rows = static_cast<int>(ids.size()) / columns;
  const double pitch = side_m + gap_m;
  BoardLayout board{dictionary, {}};
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      board.markers.push_back({ids[static_cast<std::size_t>(row * columns + column)],
                               side_m,
                               {(column - 0.5 * (columns - 1)) * pitch, (0.5 * (rows - 1) - row) * pitch}});
  return board;
}

std::array<glm::dvec2, 4> board_corners(const PlacedMarker& marker) {
  const double h = 0.5 * marker.side_m;
  const glm::dvec2 c = marker.centre_m;
  return {c + glm::dvec2(-h, h), c + glm::dvec2(h, h), c + glm::dvec2(h, -h), c + glm::dvec2(-h, -h)};
}

} // namespace daylit
