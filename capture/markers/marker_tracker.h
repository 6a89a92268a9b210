#pragma once

// Markers from frame to frame: looked for around where they were, in the whole picture only when one is missing.

#include <vector>

#include "capture/markers/find_markers.h"

namespace daylit {

class MarkerTracker {
public:
  /// `exponent`: of the camera's curve, as in find_markers().
  explicit MarkerTracker(BoardLayout board, double exponent = kPhotographExponent)
      : board_(std::move(board)), exponent_(exponent) {}

  /// As find_markers() for the markers of the board. The whole picture is searched for the first frame, while a marker
  /// of the board is not in view, and when one left the surroundings of its last position.
  Result<std::vector<SeenMarker>> find(const Rgb8Image& picture);
  const BoardLayout& board() const { return board_; }

private:
  bool knows_all() const;

  BoardLayout board_;
  double exponent_;
  std::vector<SeenMarker> last_;
  int width_ = 0, height_ = 0;
};

} // namespace daylit
