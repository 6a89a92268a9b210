#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include "runtime/base/render_camera.h"
#include "runtime/depth/thing_layer.h"
#include "runtime/picture/picture_renderer.h"

namespace daylit {

/// A drawn frame in the photograph's pixels.
struct DrawnPicture {
  const RenderedFrame& frame;
  const RenderCamera& camera;
  const ThingLayer* things = nullptr; ///< that stand before the objects; null: none

  DrawnPixel at(int x, int y) const { return frame.shown(x, y) ? frame.at(x, y) : DrawnPixel{}; }

  /// Every pixel of the photograph's box was drawn, by an undistorted camera, and shows one surface of the room at
  /// most.
  bool shows_plainly(const PixelBox& photo) const {
    const PixelBox box = photo.common(frame.box);
    if (!camera.drawn_position.empty() || box.x0 != photo.x0 || box.y0 != photo.y0 || box.x1 != photo.x1 ||
        box.y1 != photo.y1)
      return false;
    for (int y = box.y0; y < box.y1; y += RenderedFrame::kBlock)
      for (int x = box.x0; x < box.x1; x += RenderedFrame::kBlock)
        if (!frame.shown(x, y) || frame.has_parts(x / RenderedFrame::kBlock, y / RenderedFrame::kBlock))
          return false;
    return true;
  }

  /// False when no photograph pixel of the box shows an object or a new shadow.
  bool may_show(const PixelBox& photo) const {
    if (!camera.drawn_position.empty())
      return true;
    const PixelBox box = photo.common(frame.box);
    constexpr int kBlock = RenderedFrame::kBlock;
    for (int y = box.y0 - box.y0 % kBlock; y < box.y1; y += kBlock)
      for (int x = box.x0 - box.x0 % kBlock; x < box.x1; x += kBlock)
        if (frame.shows(x / kBlock, y / kBlock))
          return true;
    return false;
  }

  /// Of the room, that a pixel of an undistorted photograph shows.
  std::uint32_t triangle(int x, int y) const {
    return camera.drawn_position.empty() ? at(x, y).triangle : kUnknownTriangle;
  }

  /// The same of the drawn pixel nearest to the photograph's.
  std::uint32_t nearest_triangle(int x, int y) const {
    const glm::ivec2 p(glm::round(position(x, y)));
    return at(p.x, p.y).triangle;
  }
  bool shows_thing(int x, int y) const {
    return things && things->part[static_cast<std::size_t>(y) * camera.photo_width_px + x] > 0.0f;
  }

  glm::vec2 position(int x, int y) const {
    return camera.drawn_position.empty()
               ? glm::vec2(x, y)
               : camera.drawn_position[static_cast<std::size_t>(y) * camera.photo_width_px + x];
  }

  /// A pixel of the photograph, without what things hide of the objects in it.
  DrawnPixel photo_pixel(int x, int y) const {
    DrawnPixel pixel = whole_pixel(x, y);
    if (things)
      pixel.object *= 1.0f - things->hides[static_cast<std::size_t>(y) * camera.photo_width_px + x];
    return pixel;
  }

  /// The surfaces of the room, where they are several: of the drawn pixel nearest to the photograph's.
  std::span<const DrawnPart> parts(int x, int y) const {
    const glm::ivec2 p(glm::round(position(x, y)));
    return frame.shown(p.x, p.y) ? frame.parts(p.x, p.y) : std::span<const DrawnPart>{};
  }

  /// The drawn pixel itself, or the bilinear mean of four where the photograph is distorted.
  DrawnPixel whole_pixel(int x, int y) const {
    if (camera.drawn_position.empty())
      return at(x, y);
    const glm::vec2 p = position(x, y);
    if (p.x < 0.0f || p.y < 0.0f)
      return {};
    const int x0 = std::min(static_cast<int>(p.x), frame.width_px - 1), x1 = std::min(x0 + 1, frame.width_px - 1);
    const int y0 = std::min(static_cast<int>(p.y), frame.height_px - 1), y1 = std::min(y0 + 1, frame.height_px - 1);
    const float s = p.x - static_cast<float>(x0), t = p.y - static_cast<float>(y0);
    const DrawnPixel a = at(x0, y0), b = at(x1, y0), c = at(x0, y1), d = at(x1, y1);
    const auto mix = [&](const auto& pa, const auto& pb, const auto& pc, const auto& pd) {
      return (1.0f - t) * ((1.0f - s) * pa + s * pb) + t * ((1.0f - s) * pc + s * pd);
    };
    return {mix(a.object, b.object, c.object, d.object), mix(a.lost_sky, b.lost_sky, c.lost_sky, d.lost_sky),
            mix(a.received, b.received, c.received, d.received), mix(a.lost_sun, b.lost_sun, c.lost_sun, d.lost_sun),
            kUnknownTriangle};
  }
};

} // namespace daylit
