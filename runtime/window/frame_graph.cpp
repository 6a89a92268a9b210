#include "runtime/window/frame_graph.h"

#include <algorithm>
#include <cmath>

namespace daylit {

void FrameGraph::add(double milliseconds) {
  times_.push_back(milliseconds);
  if (times_.size() > kFrames)
    times_.pop_front();
}

void FrameGraph::draw(Rgb8Image& picture) const {
  const auto height_of = [](double ms) {
    return static_cast<int>(std::lround(kHeight_px * std::clamp(ms / kTop_ms, 0.0, 1.0)));
  };
  const auto put = [&picture](int x, int up, std::uint8_t r, std::uint8_t g, std::uint8_t b) {
    const int y = picture.height - 1 - up;
    if (x >= picture.width || y < 0)
      return;
    std::uint8_t* pixel =
        &picture.bytes[3 * (static_cast<std::size_t>(y) * picture.width + static_cast<std::size_t>(x))];
    pixel[0] = r, pixel[1] = g, pixel[2] = b;
  };
  for (int x = 0; x < static_cast<int>(times_.size()); ++x) {
    const double ms = times_[static_cast<std::size_t>(x)];
    for (int up = 0; up < height_of(ms); ++up)
      ms > kLine_ms ? put(x, up, 230, 120, 40) : put(x, up, 70, 180, 90);
    put(x, height_of(kLine_ms), 255, 255, 255);
  }
}

} // namespace daylit
