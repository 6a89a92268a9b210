#pragma once

// Markers from frame to frame: looked for around where they were, in the whole picture only when one is missing.

#include <vector>

#include "runtime/input/marker_pose.h"

namespace daylit {

class MarkerTracker {
public:
  explicit MarkerTracker(BoardLayout board) : board_(std::move(board)) {}

  /// As find_markers() for the markers of the board. The whole picture is searched for the first frame, while a marker
  /// of the board is not in view, and when one left the surroundings of its last position.
  Result<std::vector<SeenMarker>> find(const Rgb8Image& picture);
  const BoardLayout& board() const { return board_; }

private:
  bool knows_all() const;

  BoardLayout board_;
  std::vector<SeenMarker> last_;
  int width_ = 0, height_ = 0;
};

} // namespace daylit
