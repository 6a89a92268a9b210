#include "scene/image/resample.h"

#include <algorithm>
#include <vector>

namespace daylit {

namespace {

/// Old pixels that a new one covers, with their fractions of its length; these sum to 1.
struct Covered {
  int first = 0;
  std::vector<float> fraction;
};

/// New pixel k of `after` covers [k r, (k + 1) r) of the old ones, r = before / after.
std::vector<Covered> covered_pixels(int before, int after) {
  std::vector<Covered> covered(static_cast<std::size_t>(after));
  const double r = static_cast<double>(before) / after;
  for (int k = 0; k < after; ++k) {
    Covered& c = covered[static_cast<std::size_t>(k)];
    const double from = k * r, to = std::min((k + 1) * r, static_cast<double>(before));
    c.first = std::min(static_cast<int>(from), before - 1);
    for (int i = c.first; i == c.first || i < to; ++i)
      c.fraction.push_back(static_cast<float>((std::min(i + 1.0, to) - std::max<double>(i, from)) / (to - from)));
  }
  return covered;
}

} // namespace

RgbImage resampled_by_area(const RgbImage& image, int width_px, int height_px) {
  const std::vector<Covered> columns = covered_pixels(image.width, width_px);
  const std::vector<Covered> rows = covered_pixels(image.height, height_px);
  RgbImage narrow(width_px, image.height), result(width_px, height_px);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < width_px; ++x) {
      const Covered& c = columns[static_cast<std::size_t>(x)];
      for (std::size_t i = 0; i < c.fraction.size(); ++i)
        narrow.at(x, y) += c.fraction[i] * image.at(c.first + static_cast<int>(i), y);
    }
  for (int y = 0; y < height_px; ++y) {
    const Covered& c = rows[static_cast<std::size_t>(y)];
    for (std::size_t i = 0; i < c.fraction.size(); ++i)
      for (int x = 0; x < width_px; ++x)
        result.at(x, y) += c.fraction[i] * narrow.at(x, c.first + static_cast<int>(i));
  }
  return result;
}

} // namespace daylit
