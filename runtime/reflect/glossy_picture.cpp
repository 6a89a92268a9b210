#include "runtime/reflect/glossy_picture.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/reflect/lobe_places.h"
#include "scene/core/parallel.h"

namespace daylit {

namespace {

// Places in a pixel at an outline: a rotated square.
constexpr std::array<glm::vec2, kLobeRays> kPlaces{glm::vec2(-0.125f, -0.375f), glm::vec2(0.375f, -0.125f),
                                                   glm::vec2(-0.375f, 0.125f), glm::vec2(0.125f, 0.375f)};
constexpr float kEdge = 0.25f;     // a larger step between neighbours, of the brighter one, is smoothed
constexpr int kFinerRounds = 2;    // of pixels traced again
constexpr float kSteep = 2.0f;     // a step between neighbours, of the mean of what is mirrored, from which on they are
constexpr float kFewShare = 0.03f; // slope below which few neighbours share a lobe
constexpr std::uint32_t kNoPart = 0xFFFFFFFFu;
// Five pixels whose sum holds each place of a pattern of four once.
constexpr std::array<float, 5> kSharedTaps{0.5f, 1.0f, 1.0f, 1.0f, 0.5f};
// A variance of a third of a square pixel: four times that of the pixel's own square.
constexpr std::array<float, 3> kEdgeTaps{0.33f, 1.0f, 0.33f};
// A neighbour counts at most so many times as bright as the pixel: the mirrored sun does not grow by a pixel.
constexpr float kBrighter = 10.0f;

/// What a pixel shows of the objects whose material is looked up, per part of it that objects fill.
struct GlossyPixel {
  Rgb diffuse{0.0f}, radiance{0.0f}; ///< an object that was drawn whole counts with a diffuse reflectance of 1
  Rgb albedo{0.0f}, coat{0.0f}, glint{0.0f}, occluded{0.0f};
  glm::vec3 normal{0.0f};
  float alpha = 0.0f;
  std::uint32_t part = kNoPart; ///< kNoPart: nothing is looked up
  bool opaque = true;           ///< nothing goes through
  bool fine = false;            ///< traced again at four places
  int met = 0;                  ///< rays of its lobe that met an object
  float samples = 0.0f;         ///< rays of the camera that met an object, whose light is summed up here

  void average() {
    diffuse /= std::max(samples, 1.0f);
    radiance /= std::max(samples, 1.0f);
    albedo /= std::max(samples, 1.0f);
    coat /= std::max(samples, 1.0f);
    glint /= std::max(samples, 1.0f);
    occluded /= std::max(samples, 1.0f);
    samples = std::min(samples, 1.0f);
  }
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
    pixels_.resize(static_cast<std::size_t>(box_.width()) * static_cast<std::size_t>(box_.height()));
    for_pixels([&](int x, int y, Queue& queue) { trace_pixel(x, y, queue); });
    for_pixels([&](int x, int y, Queue& queue) { trace_more(x, y, queue); });
    for (int k = 0; k < kFinerRounds && mark_steep(); ++k)
      for_pixels([&](int x, int y, Queue& queue) { trace_finer(x, y, queue); });
    std::atomic<std::uint64_t> count = 0;
    parallel_for(box_.y0, box_.y1, [&](int y) { count += write_row(y, scale); });
    return {count, ray_count_};
  }

private:
  /// Rays of the camera that wait to be followed together, and the pixels that they belong to.
  struct Queue {
    std::array<WorldRay, kRayBatch> rays{};
    std::array<std::size_t, kRayBatch> pixel{};
    std::array<std::array<glm::vec2, kLobeRays>, kRayBatch> places{};
    std::array<std::size_t, kRayBatch> place_count{};
    std::array<int, kRayBatch> pattern{};
    std::size_t count = 0;
    bool beside_room = false; ///< what of the room stands before an object is looked for
    std::uint64_t traced = 0;
  };

  /// In squares of sixteen pixels, whose rays go nearly the same way.
  template <class Pixel>
  void for_pixels(const Pixel& pixel) {
    constexpr int kSide = 4;
    parallel_for(
        tbb::blocked_range<int>(0, (box_.height() + kSide - 1) / kSide), [&](const tbb::blocked_range<int>& rows) {
          Queue queue;
          for (int row = rows.begin(); row != rows.end(); ++row)
            for (int x0 = box_.x0; x0 < box_.x1; x0 += kSide)
              for (int k = 0; k < kSide * kSide; ++k) {
                const int x = x0 + k % kSide, y = box_.y0 + kSide * row + k / kSide;
                if (box_.contains(x, y))
                  pixel(x, y, queue);
              }
          follow(queue);
          ray_count_ += queue.traced;
          for (int y = box_.y0 + kSide * rows.begin(); y < std::min(box_.y0 + kSide * rows.end(), box_.y1); ++y)
            for (int x = box_.x0; x < box_.x1; ++x)
              pixels_[in_box(x, y)].average();
        });
  }
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * composite_.picture.width + x; }
  std::size_t in_box(int x, int y) const {
    return static_cast<std::size_t>(y - box_.y0) * box_.width() + static_cast<std::size_t>(x - box_.x0);
  }

  /// Inside an object one ray of the camera, with four rays of its lobe where that is wide; elsewhere four, each with
  /// one.
  void trace_pixel(int x, int y, Queue& queue) {
    const float coverage = composite_.coverage[index(x, y)];
    if (coverage >= 1.0f)
      add(x, y, queue);
    else if (coverage > 0.0f)
      add_four(x, y, true, queue);
  }
  /// Of what a narrow lobe shows.
  using Light = Rgb GlossyPixel::*;
  /// A neighbour differs by more than kEdge of the brighter one, and by `least`.
  bool is_edge(int x, int y, const GlossyPixel& p, Light light, float least = 0.0f) const {
    constexpr std::array<glm::ivec2, 4> kBeside{glm::ivec2(1, 0), glm::ivec2(-1, 0), glm::ivec2(0, 1),
                                                glm::ivec2(0, -1)};
    return std::ranges::any_of(kBeside, [&](const glm::ivec2& d) {
      if (!box_.contains(x + d.x, y + d.y))
        return false;
      const GlossyPixel& q = pixels_[in_box(x + d.x, y + d.y)];
      const float a = luminance(p.*light), b = luminance(q.*light);
      return q.part != kNoPart && std::fabs(a - b) > std::max(kEdge * std::max(a, b), least);
    });
  }

  float mean_mirrored() const {
    float sum = 0.0f, count = 0.0f;
    for (const GlossyPixel& p : pixels_)
      if (p.part != kNoPart) {
        sum += luminance(p.radiance + p.coat);
        count += 1.0f;
      }
    return sum / std::max(count, 1.0f);
  }
  /// Mirrors that bend show a window in lines narrower than a pixel, which one ray meets here and there. The pixels
  /// that do and those beside them are traced again, and in the next round those that then turn out to be beside one.
  bool mark_steep() {
    const float least = kSteep * mean_mirrored();
    finer_.assign(pixels_.size(), 0);
    std::atomic<bool> any = false;
    parallel_for(box_.y0, box_.y1, [&](int y) {
      for (int x = box_.x0; x < box_.x1; ++x) {
        const GlossyPixel& p = pixels_[in_box(x, y)];
        if (p.part == kNoPart || p.fine || !p.opaque || composite_.coverage[index(x, y)] < 1.0f)
          continue;
        if ((p.alpha < kWideAlpha && is_edge(x, y, p, &GlossyPixel::radiance, least)) ||
            (p.coat != Rgb(0.0f) && is_edge(x, y, p, &GlossyPixel::coat, least))) {
          finer_[in_box(x, y)] = 1;
          any = true;
        }
      }
    });
    return any;
  }
  void trace_finer(int x, int y, Queue& queue) {
    if (!finer_[in_box(x, y)])
      return;
    pixels_[in_box(x, y)] = {};
    pixels_[in_box(x, y)].fine = true;
    add_four(x, y, false, queue);
  }

  /// Metal that sees itself, a cup or a knot: after two narrow lobes four rays are grain, eight less.
  void trace_more(int x, int y, Queue& queue) {
    const GlossyPixel& p = pixels_[in_box(x, y)];
    if (p.met < kLobeRays / 2 || p.alpha < kWideAlpha || p.alpha >= kFewShare ||
        composite_.coverage[index(x, y)] < 1.0f)
      return;
    add(x, y, queue, kLobeRays);
  }

  void add(int x, int y, Queue& queue, int turn = 0) {
    const std::size_t ray = next(x, y, glm::vec2(0.0f), queue);
    queue.pattern[ray] = (queue.pattern[ray] + turn) & 15;
    for (int k = 0; k < kLobeRays; ++k)
      queue.places[ray][queue.place_count[ray]++] = lobe_place(x, y, k, turn);
  }
  void add_four(int x, int y, bool beside_room, Queue& queue) {
    for (int k = 0; k < kLobeRays; ++k) {
      const std::size_t ray = next(x, y, kPlaces[static_cast<std::size_t>(k)], queue);
      queue.places[ray][queue.place_count[ray]++] = lobe_place(x, y, k);
      queue.beside_room = queue.beside_room || beside_room;
    }
  }
  /// Room for one more ray of the camera.
  std::size_t next(int x, int y, const glm::vec2& place, Queue& queue) {
    if (queue.count == kRayBatch)
      follow(queue);
    queue.rays[queue.count] = camera_ray(x, y, place);
    queue.pixel[queue.count] = in_box(x, y);
    queue.place_count[queue.count] = 0;
    queue.pattern[queue.count] = pattern_of(x, y);
    return queue.count++;
  }
  void follow(Queue& queue) {
    const std::size_t count = std::exchange(queue.count, 0);
    std::array<double, kRayBatch> most;
    most.fill(kFar_m);
    if (std::exchange(queue.beside_room, false)) {
      std::array<RoomRay, kRayBatch> room;
      for (std::size_t k = 0; k < count; ++k)
        room[k].ray = queue.rays[k];
      room_.find_ends({room.data(), count});
      for (std::size_t k = 0; k < count; ++k)
        most[k] = room[k].end ? room[k].end->distance : kFar_m;
    }
    std::array<std::optional<ObjectPoint>, kRayBatch> points;
    room_.objects.closest({queue.rays.data(), count}, most, points);
    look(queue, points, count);
  }
  void look(Queue& queue, std::span<const std::optional<ObjectPoint>> points, std::size_t count) {
    std::array<CameraPoint, kRayBatch> looked_up;
    std::array<GlossyPixel*, kRayBatch> pixel;
    std::size_t n = 0;
    for (std::size_t k = 0; k < count; ++k) {
      if (!points[k])
        continue;
      GlossyPixel& p = pixels_[queue.pixel[k]];
      p.samples += 1.0f;
      if (!room_.objects.objects().parts[points[k]->part].per_pixel) {
        p.diffuse += 1.0f;
        continue;
      }
      p.part = static_cast<std::uint32_t>(points[k]->part);
      looked_up[n] = {queue.rays[k], *points[k], std::span(queue.places[k]).first(queue.place_count[k]),
                      points[k]->distance / drawn_.camera.fx, queue.pattern[k]};
      pixel[n++] = &p;
    }
    std::array<GlossyLight, kRayBatch> light;
    queue.traced += rays_.look({looked_up.data(), n}, light);
    for (std::size_t k = 0; k < n; ++k) {
      pixel[k]->diffuse += light[k].diffuse;
      pixel[k]->radiance += light[k].radiance;
      pixel[k]->albedo += light[k].albedo;
      pixel[k]->coat += light[k].coat;
      pixel[k]->glint += light[k].glint;
      pixel[k]->occluded += light[k].occluded;
      pixel[k]->normal = light[k].normal;
      pixel[k]->alpha = light[k].alpha;
      pixel[k]->opaque = light[k].opaque;
      pixel[k]->met += light[k].met;
    }
  }
  WorldRay camera_ray(int x, int y, const glm::vec2& place) const {
    const glm::vec2 at = drawn_.position(x, y) + place;
    return {drawn_.camera.eye(), glm::vec3(drawn_.camera.direction(glm::dvec2(at)))};
  }

  /// picture += scale (new - drawn). Returns the pixels written: those with an object.
  std::uint64_t write_row(int y, const PhotoScale& scale) {
    std::uint64_t written = 0;
    for (int x = box_.x0; x < box_.x1; ++x) {
      const GlossyPixel& p = pixels_[in_box(x, y)];
      if (p.part == kNoPart)
        continue;
      ++written;
      const glm::vec4 object = drawn_.photo_pixel(x, y).object;
      const Rgb coat = p.coat == Rgb(0.0f) ? p.coat : with_smooth_edges(x, y, p, &GlossyPixel::coat);
      const Rgb shown = Rgb(object) * p.diffuse + object.w * (smoothed(x, y, p) + coat + p.glint - p.occluded);
      Rgb& pixel = composite_.picture.texels[index(x, y)];
      pixel = glm::max(pixel + scale.apply(shown - Rgb(object)), Rgb(0.0f));
    }
    return written;
  }
  /// Squared angle of the normals.
  static float turn2(const GlossyPixel& p, const GlossyPixel& q) {
    const glm::vec3 turn = q.normal - p.normal;
    return glm::dot(turn, turn);
  }
  /// To the next pixels: into one pixel a curved surface mirrors as much as a lobe of that width does.
  float turn2_to_next(int x, int y, const GlossyPixel& p) const {
    float most = 0.0f;
    for (const auto& [i, j] : {std::pair(1, 0), std::pair(0, 1)})
      if (box_.contains(x + i, y + j))
        if (const GlossyPixel& q = pixels_[in_box(x + i, y + j)]; q.part == p.part)
          most = std::max(most, turn2(p, q));
    return most;
  }
  /// A wide lobe is shared by the pixels around, per part of light that each sends on: textures stay sharp. A narrow
  /// one shows pictures, whose edges are smoothed.
  Rgb smoothed(int x, int y, const GlossyPixel& p) const {
    if (p.alpha >= kWideAlpha) { // weight 1 - (angle of the normals / alpha)^2
      const float alpha2 = p.alpha * p.alpha, most2 = std::clamp(2.0f * turn2_to_next(x, y, p), alpha2, 16.0f * alpha2);
      return p.albedo *
             mean_around(
                 x, y, kSharedTaps,
                 [&](const GlossyPixel& q) {
                   return q.part == p.part ? std::max(1.0f - turn2(p, q) / most2, 0.0f) : 0.0f;
                 },
                 [](const GlossyPixel& q) { return q.radiance / glm::max(q.albedo, Rgb(kLeastReflectance)); });
    }
    return with_smooth_edges(x, y, p, &GlossyPixel::radiance);
  }
  Rgb with_smooth_edges(int x, int y, const GlossyPixel& p, Light light) const {
    if (p.fine || composite_.coverage[index(x, y)] < 1.0f || !is_edge(x, y, p, light))
      return p.*light;
    return mean_around(
        x, y, kEdgeTaps, [&](const GlossyPixel& q) { return q.part == p.part ? 1.0f : 0.0f; },
        [&](const GlossyPixel& q) { return glm::min(q.*light, kBrighter * p.*light); });
  }
  template <std::size_t N, class Weight, class Light>
  Rgb mean_around(int x, int y, const std::array<float, N>& taps, const Weight& weight_of, const Light& light) const {
    constexpr int kReach = static_cast<int>(N / 2);
    Rgb sum(0.0f);
    float whole = 0.0f;
    for (int j = -kReach; j <= kReach; ++j)
      for (int i = -kReach; i <= kReach; ++i) {
        if (!box_.contains(x + i, y + j))
          continue;
        const GlossyPixel& q = pixels_[in_box(x + i, y + j)];
        const float weight =
            taps[static_cast<std::size_t>(i + kReach)] * taps[static_cast<std::size_t>(j + kReach)] * weight_of(q);
        sum += weight * light(q);
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
  std::vector<GlossyPixel> pixels_; ///< in the box
  std::vector<std::uint8_t> finer_; ///< the same: to be traced again
  std::atomic<std::uint64_t> ray_count_{0};
};

} // namespace

bool any_per_pixel(const VirtualObjects& objects) {
  return std::ranges::any_of(objects.parts, [](const VirtualObjects::Part& p) { return p.per_pixel; });
}

bool any_normal_map(const VirtualObjects& objects) {
  return std::ranges::any_of(objects.parts, [](const VirtualObjects::Part& p) {
    return std::ranges::any_of(p.mesh().materials,
                               [](const ObjectMaterial& m) { return static_cast<bool>(m.normal_texture); });
  });
}

GlossyCounts draw_glossy(const DrawnPicture& drawn, const GlossyRays& rays, const RoomSeen& room,
                         const PhotoScale& scale, Composite& composite) {
  return GlossyPainter(drawn, rays, room, composite).paint(scale);
}

} // namespace daylit
