#pragma once

#include <algorithm>

namespace daylit {

/// Half-open rectangle of pixels.
struct PixelBox {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  bool empty() const { return x0 >= x1 || y0 >= y1; }
  int width() const { return std::max(x1 - x0, 0); }
  int height() const { return std::max(y1 - y0, 0); }
  bool contains(int x, int y) const { return x >= x0 && x < x1 && y >= y0 && y < y1; }
  void include(const PixelBox& other) {
    if (other.empty())
      return;
    *this = empty() ? other
                    : PixelBox{std::min(x0, other.x0), std::min(y0, other.y0), std::max(x1, other.x1),
                               std::max(y1, other.y1)};
  }
  PixelBox common(const PixelBox& other) const {
    return {std::max(x0, other.x0), std::max(y0, other.y0), std::min(x1, other.x1), std::min(y1, other.y1)};
  }
  PixelBox clipped(int width, int height) const {
    return {std::clamp(x0, 0, width), std::clamp(y0, 0, height), std::clamp(x1, 0, width), std::clamp(y1, 0, height)};
  }
  bool operator==(const PixelBox&) const = default;
};

} // namespace daylit
