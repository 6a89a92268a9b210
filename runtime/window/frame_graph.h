#pragma once

// The times of the last frames as bars in the lower left corner of a picture.

#include <deque>

#include "scene/image/image_formats.h"

namespace daylit {

class FrameGraph {
public:
  static constexpr int kFrames = 120, kHeight_px = 60;
  static constexpr double kTop_ms = 100.0, kLine_ms = 1000.0 / 30.0; ///< longest bar; drawn line

  void add(double milliseconds);
  void draw(Rgb8Image& picture) const;

private:
  std::deque<double> times_;
};

} // namespace daylit
