#include "runtime/depth/thing_layer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/core/parallel.h"

namespace daylit {

namespace {

constexpr int kAround = 2; // pixels to each side that say what colour the two sides of an edge have
// The colours of the sides must lie further apart than so many deviations within them, and than this of their size.
constexpr float kDeviationsApart = 3.0f, kLeastContrast = 0.1f;
// Places in a pixel at which an object is looked for.
constexpr std::array<glm::dvec2, 5> kPlaces{glm::dvec2(0.0, 0.0), glm::dvec2(-0.125, -0.375), glm::dvec2(0.375, -0.125),
                                            glm::dvec2(-0.375, 0.125), glm::dvec2(0.125, 0.375)};

/// Mean and spread of colours.
struct Colours {
  Rgb sum{0.0f};
  float squares = 0.0f;
  int count = 0;
  void add(const Rgb& c) {
    sum += c;
    squares += glm::dot(c, c);
    ++count;
  }
  Rgb mean() const { return count > 0 ? sum / static_cast<float>(count) : Rgb(0.0f); }
  float variance() const {
    return count > 0 ? std::max(squares / static_cast<float>(count) - glm::dot(mean(), mean()), 0.0f) : 0.0f;
  }
};

} // namespace

/// The colours around an edge, and how much of the pixels around shows the thing.
struct ThingLayerMaker::Sides {
  Colours thing, behind;
  float shown = 0.0f; ///< 0..1, of three by three pixels, the middle ones counting more
};

ThingLayerMaker::ThingLayerMaker(const RealThings& things, const RenderCamera& camera, const PhotoPixels& photo)
    : things_(things), camera_(camera), photo_(photo) {}

glm::ivec2 ThingLayerMaker::drawn(int x, int y) const {
  if (camera_.drawn_position.empty())
    return {x, y};
  const glm::vec2 p = camera_.drawn_position[photo_.index(x, y)];
  return glm::ivec2(glm::floor(glm::max(p, glm::vec2(-1.0f)) + 0.5f));
}

float ThingLayerMaker::z(int x, int y) const {
  if (x < 0 || y < 0 || x >= photo_.width() || y >= photo_.height())
    return 0.0f;
  const glm::ivec2 p = drawn(x, y);
  return p.x >= 0 && p.y >= 0 && p.x < things_.width_px() && p.y < things_.height_px() ? things_.z(p.x, p.y) : 0.0f;
}

std::optional<ThingPoint> ThingLayerMaker::point(int x, int y) const {
  return z(x, y) > 0.0f ? things_.point(drawn(x, y).x, drawn(x, y).y) : std::nullopt;
}

/// A pixel beside it is of the other kind. The border of the picture is no edge.
bool ThingLayerMaker::is_edge(int x, int y) const {
  const bool here = z(x, y) > 0.0f;
  for (int v = std::max(y - 1, 0); v <= std::min(y + 1, photo_.height() - 1); ++v)
    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, photo_.width() - 1); ++u)
      if ((z(u, v) > 0.0f) != here)
        return true;
  return false;
}

/// Colours of pixels that are no edge themselves.
ThingLayerMaker::Sides ThingLayerMaker::sides(int x, int y) const {
  Sides s;
  float weights = 0.0f;
  for (int j = -kAround; j <= kAround; ++j)
    for (int i = -kAround; i <= kAround; ++i) {
      const int u = x + i, v = y + j;
      if (u < 0 || v < 0 || u >= photo_.width() || v >= photo_.height())
        continue;
      const bool thing = z(u, v) > 0.0f;
      if (std::abs(i) < 2 && std::abs(j) < 2) {
        const auto weight = static_cast<float>((2 - std::abs(i)) * (2 - std::abs(j)));
        s.shown += thing ? weight : 0.0f;
        weights += weight;
      }
      if (!is_edge(u, v))
        (thing ? s.thing : s.behind).add(photo_[photo_.index(u, v)]);
    }
  s.shown /= weights;
  return s;
}

/// a = (p - B).(F - B) / |F - B|^2, the nearest on the line between both colours. `contrast`: F - B.
float ThingLayerMaker::part(int x, int y, Rgb& contrast) const {
  const Sides s = sides(x, y);
  contrast = Rgb(0.0f);
  if (s.thing.count == 0 || s.behind.count == 0)
    return s.shown;
  const Rgb behind = s.behind.mean(), apart = s.thing.mean() - behind;
  const float apart2 = glm::dot(apart, apart);
  const float least = kLeastContrast * std::max(glm::length(s.thing.mean()), glm::length(behind));
  if (!(apart2 > least * least &&
        apart2 > kDeviationsApart * kDeviationsApart * (s.thing.variance() + s.behind.variance())))
    return s.shown;
  contrast = apart;
  return std::clamp(glm::dot(photo_[photo_.index(x, y)] - behind, apart) / apart2, 0.0f, 1.0f);
}

/// Of the thing in a pixel or beside it.
float ThingLayerMaker::nearest_z(int x, int y) const {
  float nearest = std::numeric_limits<float>::infinity();
  for (int v = y - 1; v <= y + 1; ++v)
    for (int u = x - 1; u <= x + 1; ++u)
      if (const float depth = z(u, v); depth > 0.0f)
        nearest = std::min(nearest, depth);
  return nearest;
}

/// Of their nearest middle where the pixel shows too little of the objects for a ray to meet them.
double ThingLayerMaker::object_z(const ObjectRays& objects, int x, int y) const {
  const glm::dvec2 middle =
      camera_.drawn_position.empty() ? glm::dvec2(x, y) : glm::dvec2(camera_.drawn_position[photo_.index(x, y)]);
  for (const glm::dvec2& place : kPlaces) {
    const glm::dvec3 direction = camera_.direction(middle + place);
    if (const auto point = objects.closest({camera_.eye(), glm::vec3(direction)}, 1e9))
      return glm::dot(direction, glm::dvec3(camera_.world_from_camera[2])) * point->distance;
  }
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < objects.objects().parts.size(); ++k)
    nearest = std::min(nearest, things_.to_camera(objects.objects().bounds(k).centre).z);
  return nearest;
}

void ThingLayerMaker::make(const ObjectRays& objects, const std::function<float(int x, int y)>& coverage,
                           ThingLayer& layer) const {
  layer.part.assign(photo_.size(), 0.0f);
  layer.hides.assign(photo_.size(), 0.0f);
  layer.edges.clear();
  std::mutex adding;
  parallel_for(0, photo_.height(), [&](int y) {
    std::vector<std::pair<std::size_t, Rgb>> edges;
    for (int x = 0; x < photo_.width(); ++x) {
      const std::size_t i = photo_.index(x, y);
      Rgb contrast(0.0f);
      float& part = layer.part[i];
      part = is_edge(x, y) ? this->part(x, y, contrast) : z(x, y) > 0.0f ? 1.0f : 0.0f;
      const float covered = part > 0.0f ? coverage(x, y) : 0.0f;
      if (covered <= 0.0f)
        continue;
      const auto front = static_cast<double>(nearest_z(x, y));
      const double behind = (object_z(objects, x, y) - front) / things_.tolerance_m(front);
      const auto hidden = static_cast<float>(std::clamp(behind, 0.0, 1.0));
      layer.hides[i] = part * hidden;
      if (contrast != Rgb(0.0f) && hidden > 0.0f)
        edges.emplace_back(i, part * (1.0f - part) * hidden * std::min(covered, 1.0f) * contrast);
    }
    const std::lock_guard lock(adding);
    layer.edges.insert(layer.edges.end(), edges.begin(), edges.end());
  });
}

} // namespace daylit
