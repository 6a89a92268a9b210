#include "runtime/trace/share_grid.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/trace/object_point.h"
#include "scene/core/parallel.h"

namespace daylit {

namespace {

constexpr float kLeastRadius_px = 32.0f, kLeastCoarseRadius_px = 72.0f; // of the objects in the picture
constexpr float kSmoothShare = 0.04f; // coarse points that differ by less speak for the fine ones between

} // namespace

/// Collects grid points of one layer until they fill the lanes, then finds their shares of the sky.
class ShareGrid::Tracer {
public:
  Tracer(const TracedScene& scene, Layer layer)
      : scene_(scene), lights_(scene.sky.lights), casters_(scene.casters()), on_object_(layer == Layer::object) {
    hints_.reset(lights_.size());
  }
  /// `words`: where to write what is found; `neighbours`: points that may save rays.
  void add(GridPoint& g, LightWord* words, std::span<const LightWord* const> neighbours) {
    points_.set(count_, g.position, g.normal);
    starts_.set(count_, g.start, g.normal);
    hints_.set(count_, neighbours);
    if (g.triangle != kNoTriangle)
      scene_.tell_own_visibility(g.triangle, count_, hints_);
    words_[count_] = words;
    g.traced = true;
    target_[count_++] = &g;
    if (count_ == kLanes)
      flush();
  }
  void flush();
  std::uint64_t rays() const { return rays_; }

private:
  const TracedScene& scene_;
  const LightGates& lights_;
  ShadowCasters casters_;
  bool on_object_;
  PointBlock points_, starts_;
  LightHints hints_;
  GridPoint* target_[kLanes];
  LightWord* words_[kLanes];
  int count_ = 0;
  BlockedLights blocked_;
  std::uint64_t rays_ = 0;
};

void ShareGrid::Tracer::flush() {
  const int count = std::exchange(count_, 0);
  if (count == 0)
    return;
  const float tnear = on_object_ ? 0.0f : kOwnSurface_m;
  points_.close(count);
  starts_.close(count);
  find_blocked_lights(lights_, casters_, points_, starts_, tnear, !on_object_, {}, hints_.verdicts(), blocked_, rays_);
  hints_.reset(lights_.size());
  note_verdicts(blocked_, {words_, static_cast<std::size_t>(count)});
  if (blocked_.lanes == 0 && (!on_object_ || !lights_.room_may_block_any()))
    return;
  LaneSums sums;
  sum_lights(lights_, blocked_, casters_, points_, starts_, tnear,
             on_object_ ? RoomShadow::on_objects : RoomShadow::where_blocked, {}, sums, rays_);
  for (int k = 0; k < count; ++k)
    for (int c = 0; c < 3; ++c)
      if (const float whole = sums.unblocked[c][k]; whole > 0.0f) {
        target_[k]->before[c] = sums.past_room[c][k] / whole;
        target_[k]->after[c] = sums.past_both[c][k] / whole;
      }
}

/// The corners of blocks that show an outline, and the coarse points around these.
void ShareGrid::mark_outlines(const VisibleSurfaces& view) {
  at_outline_.assign(static_cast<std::size_t>(columns_) * rows_, 0);
  const auto mark = [&](int column, int row) {
    if (column >= blocks_.x0 && row >= blocks_.y0 && column < blocks_.x1 && row < blocks_.y1)
      at_outline_[static_cast<std::size_t>(row) * columns_ + column] = 1;
  };
  for (std::size_t k = 0; k < view.edge_pixels(); ++k) {
    const glm::ivec2 block = view.edge_pixel(k) / kBlockSide;
    for (int v = -1; v <= 2; ++v)
      for (int u = -1; u <= 2; ++u) {
        const bool corner = u >= 0 && u <= 1 && v >= 0 && v <= 1;
        if (corner || is_coarse(block.x + u, block.y + v))
          mark(block.x + u, block.y + v);
      }
  }
}

/// Of the blocks that are traced and those around them.
void ShareGrid::clear_points() {
  const PixelBox all =
      PixelBox{blocks_.x0 - 1, blocks_.y0 - 1, blocks_.x1 + 1, blocks_.y1 + 1}.clipped(columns_, rows_);
  points_.resize(2 * static_cast<std::size_t>(columns_) * rows_);
  parallel_for(tbb::blocked_range<int>(all.y0, all.y1, 4), [&](const tbb::blocked_range<int>& range) {
    for (int row = range.begin(); row != range.end(); ++row)
      std::fill_n(&points_[index(Layer::object, all.x0, row)], 2 * all.width(), GridPoint{});
  });
}

GridPoint ShareGrid::object_point_at(const TracedScene& scene, const VisibleSurfaces& view, int column, int row) const {
  GridPoint point;
  const int x = column * kBlockSide, y = row * kBlockSide;
  const ObjectHit& hit = view.object(x, y);
  if (view.is_edge(x, y) || hit.samples == 0)
    return point;
  const ObjectPoint at = object_point(scene, view.eye(), hit);
  point.exists = point.receives = true;
  point.triangle = at.back ? kNoTriangle : hit.triangle;
  point.normal = at.normal;
  point.position = at.position;
  point.start = ray_start(scene, hit, at);
  return point;
}

/// The room behind an object counts beside its outline: a block there has corners on all sides.
GridPoint ShareGrid::room_point_at(const TracedScene& scene, const VisibleSurfaces& view,
                                   std::span<const std::uint8_t> receives, int column, int row) const {
  GridPoint point;
  const int x = column * kBlockSide, y = row * kBlockSide;
  const std::size_t block = static_cast<std::size_t>(row) * columns_ + column;
  const RoomHit room = view.room(x, y);
  if (room.triangle == kNoTriangle || (view.object(x, y).samples > 0 && !at_outline_[block]))
    return point;
  point.exists = true;
  point.receives = receives[block] != 0;
  point.position = point.start = view.eye() + room.depth * view.direction(static_cast<float>(x), static_cast<float>(y));
  const glm::vec3 n = scene.room_normals[room.triangle];
  point.normal = glm::dot(n, view.eye() - point.position) < 0.0f ? -n : n;
  return point;
}

/// What the pixels of the grid show, and which of the sun's lights reach them.
std::uint64_t ShareGrid::find_row(const TracedScene& scene, const VisibleSurfaces& view,
                                  std::span<const std::uint8_t> receives, int row) {
  std::uint64_t rays = 0;
  for (int column = blocks_.x0; column < blocks_.x1; ++column) {
    points_[index(Layer::object, column, row)] = object_point_at(scene, view, column, row);
    points_[index(Layer::room, column, row)] = room_point_at(scene, view, receives, column, row);
    for (const Layer layer : {Layer::object, Layer::room}) {
      const std::size_t i = index(layer, column, row);
      if (const GridPoint& g = points_[i]; sun_groups_ > 0 && g.receives)
        trace_point(scene.sun.lights, scene.casters(), g.start, g.normal,
                    layer == Layer::object ? PointOf::object : PointOf::room,
                    {&sun_bits_[i * sun_groups_], sun_groups_}, rays);
    }
  }
  return rays;
}

/// Whether an outline or another part of an object shows beside the point: the shadow where two parts touch is narrower
/// than the grid of coarse points.
bool ShareGrid::by_another_part(int column, int row, float radius) const {
  if (at_outline_[static_cast<std::size_t>(row) * columns_ + column])
    return true;
  const GridPoint& g = at(Layer::object, column, row);
  for (int v = std::max(row - 1, blocks_.y0); v <= std::min(row + 1, blocks_.y1 - 1); ++v)
    for (int u = std::max(column - 1, blocks_.x0); u <= std::min(column + 1, blocks_.x1 - 1); ++u)
      if (const GridPoint& o = at(Layer::object, u, v);
          o.exists && !speaks_for(o, Layer::object, g.position, g.normal, radius))
        return true;
  return false;
}

/// The mean of the coarse points around a fine one, where these speak for it and agree. `neighbours`: those that were
/// traced and speak for it.
bool ShareGrid::interpolate(Layer layer, int column, int row, float radius, std::vector<const LightWord*>& neighbours) {
  GridPoint& g = points_[index(layer, column, row)];
  const int dx = (column - blocks_.x0) % 2, dy = (row - blocks_.y0) % 2;
  Rgb before(0.0f), after(0.0f), low(1.0f), high(0.0f);
  bool all = true;
  neighbours.clear();
  if (layer == Layer::object && by_another_part(column, row, radius))
    return false;
  for (int k = 0; k < 4; ++k) {
    const int u = column + (k & 1 ? dx : -dx), v = row + (k & 2 ? dy : -dy);
    if (u >= blocks_.x1 || v >= blocks_.y1 || !speaks_for(at(layer, u, v), layer, g.position, g.normal, radius)) {
      all = false;
      continue;
    }
    const GridPoint& coarse = at(layer, u, v);
    if (coarse.traced)
      neighbours.push_back(sky_words(layer, u, v));
    before += 0.25f * coarse.before;
    after += 0.25f * coarse.after;
    low = glm::min(low, glm::min(coarse.after, coarse.before));
    high = glm::max(high, glm::max(coarse.after, coarse.before));
  }
  if (!all && layer == Layer::room)
    neighbours.clear(); // beside an object: what is hidden may be the shadow where both touch
  const Rgb range = high - low;
  if (!all || std::max({range.r, range.g, range.b}) > kSmoothShare)
    return false;
  g.before = before;
  g.after = after;
  return true;
}

/// Shares of the coarse points of a tile of blocks, or of the others.
std::uint64_t ShareGrid::trace_tile(const TracedScene& scene, const PixelBox& tile, bool coarse) {
  std::uint64_t rays = 0;
  std::vector<const LightWord*> neighbours;
  const float radius = static_cast<float>(scene.sphere.radius);
  for (const Layer layer : {Layer::object, Layer::room}) {
    Tracer tracer(scene, layer);
    for (int row = tile.y0; row < tile.y1; ++row)
      for (int column = tile.x0; column < tile.x1; ++column) {
        const std::size_t i = index(layer, column, row);
        if (points_[i].receives && is_coarse(column, row) == coarse &&
            (coarse || !interpolate(layer, column, row, radius, neighbours)))
          tracer.add(points_[i], &sky_words_[i * sky_word_count_], neighbours);
      }
    tracer.flush();
    rays += tracer.rays();
  }
  return rays;
}

/// False where the objects are too small in the picture for any sharing.
bool ShareGrid::choose_stride(const TracedScene& scene, const VisibleSurfaces& view) {
  const ShadowCasters casters = scene.casters();
  const float radius_px = view.radius_px(casters.centre, casters.radius);
  stride_ = radius_px < kLeastCoarseRadius_px ? 1 : 2;
  return scene.settings.share_visibility && radius_px >= kLeastRadius_px;
}

std::uint64_t ShareGrid::trace(const TracedScene& scene, const VisibleSurfaces& view,
                               std::span<const std::uint8_t> receives, const PixelBox& box) {
  constexpr int kTile = 8; // blocks: its coarse points fill the lanes
  if (!choose_stride(scene, view)) {
    points_.clear();
    return 0;
  }
  columns_ = view.block_columns();
  rows_ = view.block_rows();
  sky_word_count_ = (scene.sky.lights.size() + 63) / 64;
  sun_groups_ = scene.sun.lights.direction_blocks().size();
  // One block more on the far sides: its top left pixel is a corner of the last blocks.
  blocks_ = {box.x0 / kBlockSide, box.y0 / kBlockSide, std::min((box.x1 - 1) / kBlockSide + 2, columns_),
             std::min((box.y1 - 1) / kBlockSide + 2, rows_)};
  clear_points();
  sky_words_.resize(points_.size() * sky_word_count_);
  sun_bits_.assign(points_.size() * sun_groups_, {});
  mark_outlines(view);
  std::atomic<std::uint64_t> rays{0};
  parallel_for(tbb::blocked_range<int>(blocks_.y0, blocks_.y1, 4), [&](const tbb::blocked_range<int>& range) {
    for (int row = range.begin(); row != range.end(); ++row)
      rays += find_row(scene, view, receives, row);
  });
  const int across = (blocks_.width() + kTile - 1) / kTile, down = (blocks_.height() + kTile - 1) / kTile;
  for (const bool coarse : {true, false})
    parallel_for(0, across * down, [&](int tile) {
      const int x0 = blocks_.x0 + tile % across * kTile, y0 = blocks_.y0 + tile / across * kTile;
      rays += trace_tile(scene, PixelBox{x0, y0, x0 + kTile, y0 + kTile}.common(blocks_), coarse);
    });
  return rays;
}

} // namespace daylit
