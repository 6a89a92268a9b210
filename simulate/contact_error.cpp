#include "simulate/contact_error.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "simulate/masked_blur.h"

namespace daylit {

namespace {

/// Luminance, smoothed over the room's pixels.
Plane smoothed(const RgbImage& image, const Plane& room) {
  Plane value(room.size());
  for (std::size_t i = 0; i < value.size(); ++i)
    value[i] = static_cast<double>(luminance(image.texels[i]));
  return blur_within(std::move(value), room, image.width, image.height);
}

/// A pixel of the object lies within the band's width.
bool beside_object(const Plane& room, int width, int height, int x, int y) {
  for (int dy = -kContactBand_px; dy <= kContactBand_px; ++dy) {
    const int reach = static_cast<int>(std::lround(std::sqrt(kContactBand_px * kContactBand_px - dy * dy)));
    for (int dx = -reach; dx <= reach; ++dx)
      if (const int u = x + dx, v = y + dy; u >= 0 && u < width && v >= 0 && v < height)
        if (room[static_cast<std::size_t>(v) * width + u] == 0.0)
          return true;
  }
  return false;
}

} // namespace

ContactError measure_contact(const RgbImage& result, const RgbImage& truth, const RgbImage& coverage) {
  Plane room(coverage.texels.size());
  for (std::size_t i = 0; i < room.size(); ++i)
    room[i] = coverage.texels[i].r <= 0.0f ? 1.0 : 0.0;
  std::vector<std::size_t> band;
  for (int y = 0; y < coverage.height; ++y)
    for (int x = 0; x < coverage.width; ++x)
      if (const std::size_t i = static_cast<std::size_t>(y) * coverage.width + x;
          room[i] > 0.0 && beside_object(room, coverage.width, coverage.height, x, y))
        band.push_back(i);
  const Plane found = smoothed(result, room), right = smoothed(truth, room);
  double square = 0.0, difference = 0.0, level = 0.0;
  for (const std::size_t i : band) {
    square += (found[i] - right[i]) * (found[i] - right[i]);
    difference += found[i] - right[i];
    level += static_cast<double>(luminance(truth.texels[i]));
  }
  if (band.empty() || level <= 0.0)
    return {};
  const auto count = static_cast<double>(band.size());
  const double mean = level / count;
  ContactError e{band.size(), std::sqrt(square / count) / mean, difference / count / mean};
  for (const std::size_t i : band) {
    const double relative = (found[i] - right[i]) / std::max(right[i], 0.25 * mean);
    e.brightest = std::max(e.brightest, relative);
    e.darkest = std::min(e.darkest, relative);
  }
  return e;
}

} // namespace daylit
