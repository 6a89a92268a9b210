#include "runtime/shading/sampling_grid.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include <glm/geometric.hpp>

#include "scene/core/parallel.h"

namespace daylit {

namespace {

constexpr float kLeastRadius_px = 32.0f, kLeastCoarseRadius_px = 72.0f; // of the objects in the picture
constexpr float kSmooth = 0.04f;      // coarse points that differ by less are valid for the fine ones between
constexpr float kNearby = 0.2f;       // of the objects' radius, on them
constexpr float kOffPlane = 0.22f;    // sine of the angle with a tangent plane, on an object
constexpr float kSamePlane_m = 1e-3f; // on the room
constexpr float kSameSideCosine = 0.8f;

} // namespace

/// On the room in the same plane; on an object close by, and neither lies far off the other's tangent plane: a fold
/// between them would have turned it (the second term of Ward's error, for normals that are alike by chance).
bool SamplingGrid::is_near(const GridPoint& g, Layer layer, const glm::vec3& position, const glm::vec3& normal) const {
  const glm::vec3 d = position - g.surface.position;
  const float off = std::max(std::fabs(glm::dot(d, normal)), std::fabs(glm::dot(d, g.surface.normal)));
  if (layer == Layer::room)
    return off < kSamePlane_m;
  const float near = kNearby * radius_, far2 = glm::dot(d, d);
  return far2 < near * near && off * off <= kOffPlane * kOffPlane * far2;
}

/// It lies on the same smooth piece of surface.
bool SamplingGrid::is_valid_for(const GridPoint& g, Layer layer, const glm::vec3& position,
                                const glm::vec3& normal) const {
  return g.surface.exists && glm::dot(g.surface.normal, normal) >= kSameSideCosine &&
         is_near(g, layer, position, normal);
}

/// Collects grid points of one layer until they fill the lanes, then evaluates them.
class SamplingGrid::Collector {
public:
  Collector(const Visibility& visibility, Layer layer, std::size_t lights)
      : visibility_(visibility), layer_(layer), lights_(lights) {
    set_.hints.reset(lights);
  }
  /// `words`: where to write what is found; `neighbours`: points that may save rays.
  void add(GridPoint& g, KnownLights* words, std::span<const KnownLights* const> neighbours) {
    const int lane = set_.add(g.surface);
    set_.hints.believe_agreeing(lane, neighbours);
    words_[lane] = words;
    target_[lane] = &g;
    g.evaluated = true;
    if (set_.count == kLanes)
      flush();
  }
  void flush() {
    const int count = std::exchange(set_.count, 0);
    if (count == 0)
      return;
    set_.points.close(count);
    set_.starts.close(count);
    rays_ += visibility_.see_sky(layer_, set_);
    set_.hints.reset(lights_);
    write_known_lights(set_.blocked, {words_, static_cast<std::size_t>(count)});
    for (int k = 0; k < count; ++k)
      target_[k]->sky = set_.sky[k];
  }
  std::uint64_t rays() const { return rays_; }

private:
  const Visibility& visibility_;
  Layer layer_;
  std::size_t lights_;
  PointSet set_;
  GridPoint* target_[kLanes];
  KnownLights* words_[kLanes];
  std::uint64_t rays_ = 0;
};

/// Blocks that show an edge, their corners, and the coarse points around these.
void SamplingGrid::mark_outlines(std::span<const glm::ivec2> pixels) {
  at_outline_.assign(points_.size() / 2, 0);
  has_edge_ = at_outline_;
  for (const glm::ivec2& pixel : pixels) {
    const glm::ivec2 block = pixel / kBlockSide;
    if (blocks_.contains(block.x, block.y))
      has_edge_[block_index(block.x, block.y)] = 1;
    for (int v = -1; v <= 2; ++v)
      for (int u = -1; u <= 2; ++u) {
        const int column = block.x + u, row = block.y + v;
        const bool corner = u >= 0 && u <= 1 && v >= 0 && v <= 1;
        if (blocks_.contains(column, row) && (corner || is_coarse(column, row)))
          at_outline_[block_index(column, row)] = 1;
      }
  }
}

void SamplingGrid::start(const SampledPicture& picture) {
  stride_ = picture.radius_px < kLeastCoarseRadius_px ? 1 : 2;
  radius_ = picture.radius;
  sky_lights_ = picture.sky_lights;
  sun_lights_ = picture.sun_lights;
  // One block more on the far sides: its first pixel is a corner of the last blocks.
  const PixelBox& box = picture.box;
  blocks_ = {box.x0 / kBlockSide, box.y0 / kBlockSide, std::min((box.x1 - 1) / kBlockSide + 2, picture.columns),
             std::min((box.y1 - 1) / kBlockSide + 2, picture.rows)};
  points_.assign(2 * static_cast<std::size_t>(blocks_.width()) * blocks_.height(), {});
  sky_words_.resize(points_.size() * words_for(sky_lights_));
  sun_words_.resize(points_.size() * words_for(sun_lights_));
  sun_room_words_.resize(sun_words_.size());
  mark_outlines(picture.outline);
}

/// What the pixels of the grid show, and which of the sun's lights reach them. The room behind an object counts beside
/// its outline: a block there has corners on all sides.
std::uint64_t SamplingGrid::find_row(const Visibility& visibility, int row) {
  std::uint64_t rays = 0;
  for (int column = blocks_.x0; column < blocks_.x1; ++column)
    for (const Layer layer : {Layer::object, Layer::room}) {
      const std::size_t i = index(layer, column, row);
      const bool outline = at_outline_[block_index(column, row)] != 0;
      GridPoint& g = points_[i];
      g = {visibility.surface(layer, column * kBlockSide, row * kBlockSide, outline), false, {}};
      if (sun_lights_ > 0 && g.surface.receives)
        rays += visibility.see_sun(layer, g.surface, words_of(sun_words_, i, sun_lights_),
                                   words_of(sun_room_words_, i, sun_lights_));
    }
  return rays;
}

/// Whether an outline or another part of an object shows beside the point: the shadow where two parts touch is narrower
/// than the grid of coarse points.
bool SamplingGrid::is_beside_another_part(int column, int row) const {
  if (at_outline_[block_index(column, row)])
    return true;
  const PixelSurface& g = at(Layer::object, column, row).surface;
  for (int v = std::max(row - 1, blocks_.y0); v <= std::min(row + 1, blocks_.y1 - 1); ++v)
    for (int u = std::max(column - 1, blocks_.x0); u <= std::min(column + 1, blocks_.x1 - 1); ++u)
      if (const GridPoint& o = at(Layer::object, u, v);
          o.surface.exists && !is_valid_for(o, Layer::object, g.position, g.normal))
        return true;
  return false;
}

/// The mean of the coarse points around a fine one, where these are valid for it and agree. `neighbours`: those that
/// were evaluated and are valid for it.
bool SamplingGrid::interpolate_fine(Layer layer, int column, int row, std::vector<const KnownLights*>& neighbours) {
  GridPoint& g = points_[index(layer, column, row)];
  const int dx = (column - blocks_.x0) % 2, dy = (row - blocks_.y0) % 2;
  SkyFractions mean{Rgb(0.0f), Rgb(0.0f)};
  FractionRange range; // of both fractions together: where the objects take anything, points are evaluated
  bool all = true;
  neighbours.clear();
  if (layer == Layer::object && is_beside_another_part(column, row))
    return false;
  for (int k = 0; k < 4; ++k) {
    const int u = column + (k & 1 ? dx : -dx), v = row + (k & 2 ? dy : -dy);
    if (u >= blocks_.x1 || v >= blocks_.y1 ||
        !is_valid_for(at(layer, u, v), layer, g.surface.position, g.surface.normal)) {
      all = false;
      continue;
    }
    const GridPoint& coarse = at(layer, u, v);
    all = all && !coarse.surface.hidden;
    if (coarse.evaluated)
      neighbours.push_back(sky_words_.data() + index(layer, u, v) * words_for(sky_lights_));
    mean.past_room += 0.25f * coarse.sky.past_room;
    mean.past_both += 0.25f * coarse.sky.past_both;
    range.include(coarse.sky.past_room);
    range.include(coarse.sky.past_both);
  }
  if (!all && layer == Layer::room)
    neighbours.clear(); // what an object hides may lie behind it, or be the shadow where both touch
  if (!all || range.width() > kSmooth)
    return false;
  g.sky = mean;
  return true;
}

/// The coarse points of a tile of blocks, or the others.
std::uint64_t SamplingGrid::evaluate_tile(const Visibility& visibility, const PixelBox& tile, bool coarse) {
  std::uint64_t rays = 0;
  std::vector<const KnownLights*> neighbours;
  for (const Layer layer : {Layer::object, Layer::room}) {
    Collector collector(visibility, layer, sky_lights_);
    for (int row = tile.y0; row < tile.y1; ++row)
      for (int column = tile.x0; column < tile.x1; ++column) {
        const std::size_t i = index(layer, column, row);
        if (points_[i].surface.receives && is_coarse(column, row) == coarse &&
            (coarse || !interpolate_fine(layer, column, row, neighbours)))
          collector.add(points_[i], sky_words_.data() + i * words_for(sky_lights_), neighbours);
      }
    collector.flush();
    rays += collector.rays();
  }
  return rays;
}

std::uint64_t SamplingGrid::evaluate(const Visibility& visibility, const SampledPicture& picture) {
  constexpr int kTile = 8; // blocks: its coarse points fill the lanes
  if (picture.radius_px < kLeastRadius_px) {
    clear();
    return 0;
  }
  start(picture);
  std::atomic<std::uint64_t> rays{0};
  parallel_for(tbb::blocked_range<int>(blocks_.y0, blocks_.y1, 4), [&](const tbb::blocked_range<int>& range) {
    for (int row = range.begin(); row != range.end(); ++row)
      rays += find_row(visibility, row);
  });
  const int across = (blocks_.width() + kTile - 1) / kTile, down = (blocks_.height() + kTile - 1) / kTile;
  for (const bool coarse : {true, false})
    parallel_for(0, across * down, [&](int tile) {
      const int x0 = blocks_.x0 + tile % across * kTile, y0 = blocks_.y0 + tile / across * kTile;
      rays += evaluate_tile(visibility, PixelBox{x0, y0, x0 + kTile, y0 + kTile}.common(blocks_), coarse);
    });
  soften(picture);
  return rays;
}

} // namespace daylit
