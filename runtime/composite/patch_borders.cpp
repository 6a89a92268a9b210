#include "runtime/composite/patch_borders.h"

#include <algorithm>
#include <vector>

#include "scene/core/parallel.h"

namespace daylit {

namespace {

constexpr float kWhole = 0.999f;      // of a pixel that shows the room alone; of the sun that a shadow takes
constexpr float kEven = 0.9f;         // of the sun around a pixel that each has where no border is
constexpr int kBeside = 1, kFrom = 3; // pixels from a border: that are filled, from where

std::uint8_t& touched(Composite& result, int x, int y) {
  return result.touched[static_cast<std::size_t>(y) * result.picture.width + x];
}

/// What pixels without objects had of the sun, where these leave none of it (pixels without sun too); kOther elsewhere.
class ShadowedSun {
public:
  static constexpr float kOther = -1.0f;

  ShadowedSun(const DrawnPicture& drawn, const PixelBox& box)
      : drawn_(drawn), box_(box), sun_(static_cast<std::size_t>(box.width()) * box.height(), kOther) {
    parallel_for(box.y0, box.y1, [&](int y) {
      for (int x = box.x0; x < box.x1; ++x)
        sun_[index(x, y)] = sun_at(x, y);
    });
  }
  float at(int x, int y) const {
    return x < box_.x0 || y < box_.y0 || x >= box_.x1 || y >= box_.y1 ? kOther : sun_[index(x, y)];
  }
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y - box_.y0) * box_.width() + (x - box_.x0); }
  bool is_empty() const {
    return std::ranges::all_of(sun_, [](float sun) { return sun <= 0.0f; });
  }
  /// The suns of the pixels around it in the shadow differ.
  bool has_border(int x, int y) const {
    if (at(x, y) == kOther)
      return false;
    float most = 0.0f, least = at(x, y);
    for (int v = y - kBeside; v <= y + kBeside; ++v)
      for (int u = x - kBeside; u <= x + kBeside; ++u)
        if (const float sun = at(u, v);
            sun != kOther && drawn_.nearest_triangle(u, v) == drawn_.nearest_triangle(x, y)) {
          most = std::max(most, sun);
          least = std::min(least, sun);
        }
    return least < kEven * most;
  }

private:
  float sun_at(int x, int y) const {
    const DrawnPixel pixel = drawn_.photo_pixel(x, y);
    const float taken = std::min({pixel.lost_sun.r, pixel.lost_sun.g, pixel.lost_sun.b});
    return pixel.lost_sky.w > kWhole && pixel.object.w <= 0.0f && !drawn_.shows_thing(x, y) &&
                   taken >= kWhole * pixel.received.y && drawn_.parts(x, y).empty()
               ? pixel.received.y
               : kOther;
  }

  const DrawnPicture& drawn_;
  PixelBox box_;
  std::vector<float> sun_;
};

/// Mean over the pixels around it that lie in the same shadow and on the same triangle, beside no border.
void fill(int x, int y, const DrawnPicture& drawn, const ShadowedSun& sun, const std::vector<std::uint8_t>& border,
          Composite& result) {
  Rgb sum(0.0f);
  int count = 0;
  for (int v = y - kFrom; v <= y + kFrom; ++v)
    for (int u = x - kFrom; u <= x + kFrom; ++u)
      if (sun.at(u, v) != ShadowedSun::kOther && !border[sun.index(u, v)] &&
          drawn.nearest_triangle(u, v) == drawn.nearest_triangle(x, y)) {
        sum += result.picture.at(u, v);
        ++count;
      }
  if (count == 0)
    return;
  result.picture.at(x, y) = sum / static_cast<float>(count);
  touched(result, x, y) = 1;
}

} // namespace

void fill_patch_borders(const DrawnPicture& drawn, Composite& result) {
  const PixelBox photo{0, 0, result.picture.width, result.picture.height},
      box = drawn.camera.drawn_position.empty() ? photo.common(drawn.frame.box) : photo;
  if (box.empty())
    return;
  const ShadowedSun sun(drawn, box);
  if (sun.is_empty())
    return;
  std::vector<std::uint8_t> border(static_cast<std::size_t>(box.width()) * box.height(), 0);
  parallel_for(box.y0, box.y1, [&](int y) {
    for (int x = box.x0; x < box.x1; ++x)
      border[sun.index(x, y)] = touched(result, x, y) == 1 && sun.has_border(x, y);
  });
  parallel_for(box.y0, box.y1, [&](int y) {
    for (int x = box.x0; x < box.x1; ++x)
      if (border[sun.index(x, y)])
        fill(x, y, drawn, sun, border, result);
  });
}

} // namespace daylit
