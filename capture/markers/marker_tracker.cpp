#include "capture/markers/marker_tracker.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/vec2.hpp>

namespace daylit {

namespace {

struct Crop {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// Around all markers, as wide again on each side as the markers together: a marker may move by its own size.
Crop surroundings(const std::vector<SeenMarker>& markers, int width, int height) {
  glm::dvec2 low(1e9), high(-1e9);
  for (const SeenMarker& m : markers)
    for (const glm::dvec2& p : m.corner_px) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
  const double margin = std::max({high.x - low.x, high.y - low.y, 16.0});
  const auto clamp = [](double v, int most) { return static_cast<int>(std::clamp(v, 0.0, static_cast<double>(most))); };
  return {clamp(std::floor(low.x - margin), width), clamp(std::floor(low.y - margin), height),
          clamp(std::ceil(high.x + margin) + 1, width), clamp(std::ceil(high.y + margin) + 1, height)};
}

Rgb8Image cut(const Rgb8Image& picture, const Crop& crop) {
  Rgb8Image part;
  part.width = crop.x1 - crop.x0;
  part.height = crop.y1 - crop.y0;
  for (int y = crop.y0; y < crop.y1; ++y) {
    const auto first = picture.bytes.begin() + 3 * (static_cast<std::ptrdiff_t>(y) * picture.width + crop.x0);
    part.bytes.insert(part.bytes.end(), first, first + 3 * part.width);
  }
  return part;
}

} // namespace

bool MarkerTracker::knows_all() const {
  return !last_.empty() && std::all_of(board_.markers.begin(), board_.markers.end(), [&](const PlacedMarker& placed) {
    return std::any_of(last_.begin(), last_.end(), [&](const SeenMarker& m) { return m.id == placed.id; });
  });
}

Result<std::vector<SeenMarker>> MarkerTracker::find(const Rgb8Image& picture) {
  const bool same_size = picture.width == width_ && picture.height == height_;
  width_ = picture.width;
  height_ = picture.height;
  if (same_size && knows_all()) {
    const Crop crop = surroundings(last_, width_, height_);
    if (2 * (crop.x1 - crop.x0) * (crop.y1 - crop.y0) < width_ * height_) {
      auto near = find_markers(cut(picture, crop), board_.dictionary, exponent_);
      if (!near)
        return near;
      for (SeenMarker& m : *near)
        for (glm::dvec2& p : m.corner_px)
          p += glm::dvec2(crop.x0, crop.y0);
      last_ = std::move(*near);
      if (knows_all())
        return last_;
    }
  }
  auto found = find_markers(picture, board_.dictionary, exponent_);
  if (found)
    last_ = *found;
  return found;
}

} // namespace daylit
