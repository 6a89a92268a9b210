#include "runtime/reflect/glossy_picture.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/core/parallel.h"

namespace daylit {

namespace {

constexpr int kSamples = 4;
// Places in a pixel that is not covered as a whole: a rotated square.
constexpr std::array<glm::vec2, kSamples> kPlaces{glm::vec2(-0.125f, -0.375f), glm::vec2(0.375f, -0.125f),
                                                  glm::vec2(-0.375f, 0.125f), glm::vec2(0.125f, 0.375f)};

/// Number `sample` of four: the R2 sequence (Roberts 2018), shifted from pixel to pixel so that a square of four by
/// four pixels covers the lobe evenly. The same in every frame: a still scene does not flicker.
glm::vec2 lobe_place(int x, int y, int sample) {
  const int in_block = (x & 3) + 4 * (y & 3);
  const auto k = static_cast<float>(4 * (in_block * 5 & 15) + sample);
  return glm::fract(glm::vec2(0.5f) + k * glm::vec2(0.754877666f, 0.569840291f));
}

class GlossyPainter {
public:
  GlossyPainter(const DrawnPicture& drawn, const GlossyRays& rays, const RoomSeen& room)
      : drawn_(drawn), rays_(rays), room_(room) {}

  /// What the object's part of a pixel is, coverage included; empty where nothing is looked up. Inside an object one
  /// ray of the camera, with four rays of its lobe where that is wide; elsewhere four, each with one.
  std::optional<Rgb> pixel(int x, int y, const glm::vec4& object, std::uint64_t& traced) const {
    const bool inside = object.w >= 1.0f;
    Shown shown;
    if (inside)
      add(x, y, glm::vec2(0.0f), -1, shown);
    else
      for (int k = 0; k < kSamples; ++k)
        add(x, y, kPlaces[static_cast<std::size_t>(k)], k, shown);
    traced += shown.rays;
    if (shown.looked_up == 0)
      return std::nullopt;
    const float whole = 1.0f / static_cast<float>(shown.met);
    return Rgb(object) * shown.diffuse * whole + object.w * shown.radiance * whole;
  }

private:
  /// Sums over the places of a pixel.
  struct Shown {
    Rgb diffuse{0.0f}, radiance{0.0f};
    int met = 0, looked_up = 0;
    std::uint64_t rays = 0;
  };
  /// `sample` -1: the whole pixel.
  void add(int x, int y, const glm::vec2& place, int sample, Shown& shown) const {
    const WorldRay ray = camera_ray(x, y, place);
    const auto wall = sample < 0 ? std::nullopt : room_.closest(ray);
    const auto point = room_.objects.closest(ray, wall ? wall->distance : 1e9);
    if (!point)
      return;
    ++shown.met;
    if (!room_.objects.objects().parts[point->part].per_pixel) {
      shown.diffuse += 1.0f;
      return;
    }
    ++shown.looked_up;
    std::array<glm::vec2, kSamples> lobe;
    for (int k = 0; k < kSamples; ++k)
      lobe[static_cast<std::size_t>(k)] = lobe_place(x, y, k);
    const std::span<const glm::vec2> all(lobe);
    const GlossyLight light = rays_.look(
        ray, *point, sample < 0 ? all : all.subspan(static_cast<std::size_t>(sample), 1), width_m(*point), shown.rays);
    shown.diffuse += light.diffuse;
    shown.radiance += light.radiance;
  }
  WorldRay camera_ray(int x, int y, const glm::vec2& place) const {
    const glm::vec2 at = drawn_.position(x, y) + place;
    return {drawn_.camera.eye(), glm::vec3(drawn_.camera.direction(glm::dvec2(at)))};
  }
  double width_m(const ObjectPoint& point) const { return point.distance / drawn_.camera.fx; }

  const DrawnPicture& drawn_;
  const GlossyRays& rays_;
  const RoomSeen& room_;
};

} // namespace

bool any_per_pixel(const VirtualObjects& objects) {
  return std::ranges::any_of(objects.parts, [](const VirtualObjects::Part& p) { return p.per_pixel; });
}

/// picture += scale (new - drawn): only pixels with an object are written, only pixels without one are read.
GlossyCounts draw_glossy(const DrawnPicture& drawn, const GlossyRays& rays, const RoomSeen& room,
                         const PhotoScale& scale, Composite& composite) {
  const GlossyPainter painter(drawn, rays, room);
  std::atomic<std::uint64_t> pixels{0}, traced{0};
  const int width = composite.picture.width;
  parallel_for(tbb::blocked_range<int>(0, composite.picture.height, 4), [&](const tbb::blocked_range<int>& rows) {
    std::uint64_t mine = 0, mine_traced = 0;
    for (int y = rows.begin(); y != rows.end(); ++y)
      for (int x = 0; x < width; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * width + x;
        if (composite.coverage[i] <= 0.0f)
          continue;
        const glm::vec4 object = drawn.photo_pixel(x, y).object;
        const auto shown = painter.pixel(x, y, object, mine_traced);
        if (!shown)
          continue;
        ++mine;
        composite.picture.texels[i] =
            glm::max(composite.picture.texels[i] + scale.apply(*shown - Rgb(object)), Rgb(0.0f));
      }
    pixels += mine;
    traced += mine_traced;
  });
  return {pixels, traced};
}

} // namespace daylit
