#include "runtime/reflect/glossy_picture.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <span>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/core/parallel.h"

namespace daylit {

namespace {

constexpr int kSamples = 4;
// Places in a pixel that shows more than one thing: a rotated square.
constexpr std::array<glm::vec2, kSamples> kPlaces{glm::vec2(-0.125f, -0.375f), glm::vec2(0.375f, -0.125f),
                                                  glm::vec2(-0.375f, 0.125f), glm::vec2(0.125f, 0.375f)};
constexpr float kEdge = 0.25f; // a larger step between neighbours, of the brighter one, is smoothed
constexpr std::uint32_t kNoPart = 0xFFFFFFFFu;
// Five pixels whose sum holds each place of a pattern of four once.
constexpr std::array<float, 5> kTaps{0.5f, 1.0f, 1.0f, 1.0f, 0.5f};

/// Number `sample` of four: sixty-four points of Hammersley 1960, dealt out so that the four of a pixel lie apart and a
/// square of four by four pixels has all. The same in every frame: a still scene does not flicker.
glm::vec2 lobe_place(int x, int y, int sample) {
  const int pixel = ((x & 3) + 4 * (y & 3)) * 5 & 15, n = kSamples * kSamples * sample + ((pixel + sample) & 15);
  int mirrored = 0;
  for (int bit = 0; bit < 6; ++bit)
    mirrored |= (n >> bit & 1) << (5 - bit);
  return (glm::vec2(n, mirrored) + 0.5f) / 64.0f;
}

/// What a pixel shows of the objects whose material is looked up, per part of it that objects fill.
struct GlossyPixel {
  Rgb diffuse{0.0f}, radiance{0.0f}; ///< an object that was drawn whole counts with a diffuse reflectance of 1
  glm::vec3 normal{0.0f};
  float alpha = 0.0f;
  std::uint32_t part = kNoPart; ///< kNoPart: nothing is looked up
};

PixelBox covered_box(const Composite& composite) {
  PixelBox box;
  const int width = composite.picture.width;
  for (int y = 0; y < composite.picture.height; ++y) {
    const auto row = composite.coverage.begin() + static_cast<std::ptrdiff_t>(y) * width, end = row + width;
    const auto first = std::find_if(row, end, [](float c) { return c > 0.0f; });
    if (first == end)
      continue;
    const auto last = std::find_if(std::make_reverse_iterator(end), std::make_reverse_iterator(row),
                                   [](float c) { return c > 0.0f; });
    box.include({static_cast<int>(first - row), y, static_cast<int>(last.base() - row), y + 1});
  }
  return box;
}

class GlossyPainter {
public:
  GlossyPainter(const DrawnPicture& drawn, const GlossyRays& rays, const RoomSeen& room, Composite& composite)
      : drawn_(drawn), rays_(rays), room_(room), composite_(composite), box_(covered_box(composite)) {}

  GlossyCounts paint(const PhotoScale& scale) {
    traced_.resize(static_cast<std::size_t>(box_.width()) * static_cast<std::size_t>(box_.height()));
    for_rows([&](int y, GlossyCounts& counts) { trace_row(y, counts); });
    pixels_ = traced_;
    for_rows([&](int y, GlossyCounts& counts) { smooth_edges(y, counts); });
    for_rows([&](int y, GlossyCounts& counts) { write_row(y, scale, counts); });
    return {pixel_count_, ray_count_};
  }

private:
  template <class Row>
  void for_rows(const Row& row) {
    parallel_for(tbb::blocked_range<int>(box_.y0, box_.y1, 4), [&](const tbb::blocked_range<int>& rows) {
      GlossyCounts mine;
      for (int y = rows.begin(); y != rows.end(); ++y)
        row(y, mine);
      pixel_count_ += mine.pixels;
      ray_count_ += mine.rays;
    });
  }
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * composite_.picture.width + x; }
  std::size_t in_box(int x, int y) const {
    return static_cast<std::size_t>(y - box_.y0) * box_.width() + static_cast<std::size_t>(x - box_.x0);
  }

  /// Inside an object one ray of the camera, with four rays of its lobe where that is wide; elsewhere four, each with
  /// one.
  void trace_row(int y, GlossyCounts& counts) {
    for (int x = box_.x0; x < box_.x1; ++x) {
      const float coverage = composite_.coverage[index(x, y)];
      if (coverage > 0.0f)
        traced_[in_box(x, y)] = coverage < 1.0f ? pixel_of_four(x, y, true, counts) : pixel_of_one(x, y, counts);
    }
  }
  /// A narrow lobe shows edges: a pixel that differs from one beside it takes four rays of the camera.
  void smooth_edges(int y, GlossyCounts& counts) {
    for (int x = box_.x0; x < box_.x1; ++x) {
      const GlossyPixel& p = traced_[in_box(x, y)];
      if (p.part != kNoPart && p.alpha < kWideAlpha && composite_.coverage[index(x, y)] >= 1.0f && is_edge(x, y, p))
        pixels_[in_box(x, y)] = pixel_of_four(x, y, false, counts);
    }
  }
  bool is_edge(int x, int y, const GlossyPixel& p) const {
    constexpr std::array<glm::ivec2, 4> kBeside{glm::ivec2(1, 0), glm::ivec2(-1, 0), glm::ivec2(0, 1),
                                                glm::ivec2(0, -1)};
    return std::ranges::any_of(kBeside, [&](const glm::ivec2& d) {
      if (!box_.contains(x + d.x, y + d.y))
        return false;
      const GlossyPixel& q = traced_[in_box(x + d.x, y + d.y)];
      const float a = luminance(p.radiance), b = luminance(q.radiance);
      return q.part != kNoPart && std::fabs(a - b) > kEdge * std::max(a, b);
    });
  }

  GlossyPixel pixel_of_one(int x, int y, GlossyCounts& counts) const {
    GlossyPixel pixel;
    std::array<glm::vec2, kSamples> lobe;
    for (int k = 0; k < kSamples; ++k)
      lobe[static_cast<std::size_t>(k)] = lobe_place(x, y, k);
    const WorldRay ray = camera_ray(x, y, glm::vec2(0.0f));
    if (const auto point = room_.objects.closest(ray, kFar_m))
      add(ray, *point, lobe, pixel, counts);
    return pixel;
  }
  /// `beside_room`: what of the room stands before an object is looked for.
  GlossyPixel pixel_of_four(int x, int y, bool beside_room, GlossyCounts& counts) const {
    GlossyPixel pixel;
    float met = 0.0f;
    for (int k = 0; k < kSamples; ++k) {
      const WorldRay ray = camera_ray(x, y, kPlaces[static_cast<std::size_t>(k)]);
      const auto wall = beside_room ? room_.closest(ray) : std::nullopt;
      const auto point = room_.objects.closest(ray, wall ? wall->distance : kFar_m);
      if (!point)
        continue;
      met += 1.0f;
      const glm::vec2 place = lobe_place(x, y, k);
      add(ray, *point, {&place, 1}, pixel, counts);
    }
    pixel.diffuse /= std::max(met, 1.0f);
    pixel.radiance /= std::max(met, 1.0f);
    return pixel;
  }
  void add(const WorldRay& ray, const ObjectPoint& point, std::span<const glm::vec2> lobe, GlossyPixel& pixel,
           GlossyCounts& counts) const {
    if (!room_.objects.objects().parts[point.part].per_pixel) {
      pixel.diffuse += 1.0f;
      return;
    }
    const GlossyLight light = rays_.look(ray, point, lobe, point.distance / drawn_.camera.fx, counts.rays);
    pixel.diffuse += light.diffuse;
    pixel.radiance += light.radiance;
    pixel.normal = light.normal;
    pixel.alpha = light.alpha;
    pixel.part = static_cast<std::uint32_t>(point.part);
  }
  WorldRay camera_ray(int x, int y, const glm::vec2& place) const {
    const glm::vec2 at = drawn_.position(x, y) + place;
    return {drawn_.camera.eye(), glm::vec3(drawn_.camera.direction(glm::dvec2(at)))};
  }

  /// picture += scale (new - drawn): only pixels with an object are written.
  void write_row(int y, const PhotoScale& scale, GlossyCounts& counts) {
    for (int x = box_.x0; x < box_.x1; ++x) {
      const GlossyPixel& p = pixels_[in_box(x, y)];
      if (p.part == kNoPart)
        continue;
      ++counts.pixels;
      const glm::vec4 object = drawn_.photo_pixel(x, y).object;
      const Rgb shown = Rgb(object) * p.diffuse + object.w * (p.alpha < kWideAlpha ? p.radiance : shared(x, y, p));
      Rgb& pixel = composite_.picture.texels[index(x, y)];
      pixel = glm::max(pixel + scale.apply(shown - Rgb(object)), Rgb(0.0f));
    }
  }
  /// Mean over the pixels around that look into nearly the same lobe: weight 1 - (angle of the normals / alpha)^2.
  Rgb shared(int x, int y, const GlossyPixel& p) const {
    Rgb sum(0.0f);
    float whole = 0.0f;
    for (int j = -2; j <= 2; ++j)
      for (int i = -2; i <= 2; ++i) {
        if (!box_.contains(x + i, y + j))
          continue;
        const GlossyPixel& q = pixels_[in_box(x + i, y + j)];
        if (q.part != p.part)
          continue;
        const glm::vec3 turn = q.normal - p.normal;
        const float near = 1.0f - glm::dot(turn, turn) / (p.alpha * p.alpha);
        const float weight =
            kTaps[static_cast<std::size_t>(i + 2)] * kTaps[static_cast<std::size_t>(j + 2)] * std::max(near, 0.0f);
        sum += weight * q.radiance;
        whole += weight;
      }
    return sum / whole;
  }

  static constexpr double kFar_m = 1e9;
  const DrawnPicture& drawn_;
  const GlossyRays& rays_;
  const RoomSeen& room_;
  Composite& composite_;
  const PixelBox box_;
  std::vector<GlossyPixel> traced_, pixels_; ///< in the box
  std::atomic<std::uint64_t> pixel_count_{0}, ray_count_{0};
};

} // namespace

bool any_per_pixel(const VirtualObjects& objects) {
  return std::ranges::any_of(objects.parts, [](const VirtualObjects::Part& p) { return p.per_pixel; });
}

GlossyCounts draw_glossy(const DrawnPicture& drawn, const GlossyRays& rays, const RoomSeen& room,
                         const PhotoScale& scale, Composite& composite) {
  return GlossyPainter(drawn, rays, room, composite).paint(scale);
}

} // namespace daylit
