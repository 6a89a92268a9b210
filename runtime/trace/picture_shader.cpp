#include "runtime/trace/picture_shader.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include <glm/geometric.hpp>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "runtime/trace/block_shader.h"

namespace daylit {

namespace {

// A grid point speaks for points nearby on the same smooth piece of surface.
constexpr float kSameSideCosine = 0.8f;
constexpr float kSamePieceShare = 0.2f; // of the objects' radius, metres apart
constexpr float kSamePlane_m = 1e-3f;
constexpr float kSmoothShare = 0.04f; // coarse points that differ by less speak for the fine ones between

} // namespace

/// Marks the blocks that a light could reach only through the objects' sphere; the box holds them and the objects.
PixelBox PictureShader::affected_box(const TracedScene& scene, const VisibleSurfaces& view) {
  const ShadowCasters casters = scene.casters();
  const int columns = view.block_columns(), rows = view.block_rows();
  receives_.assign(static_cast<std::size_t>(columns) * rows, 0);
  std::vector<PixelBox> row_box(static_cast<std::size_t>(rows));
  tbb::parallel_for(tbb::blocked_range<int>(0, rows, 8), [&](const tbb::blocked_range<int>& range) {
    for (int row = range.begin(); row != range.end(); ++row)
      for (int column = 0; column < columns; ++column) {
        const BlockBound& b = view.block(column, row);
        if (b.radius < 0.0f || (!may_be_shadowed(scene.sky.cone, casters, b.centre, b.radius) &&
                                !may_be_shadowed(scene.sun.cone, casters, b.centre, b.radius)))
          continue;
        receives_[static_cast<std::size_t>(row) * columns + column] = 1;
        row_box[row].include(
            {column * kBlockSide, row * kBlockSide, (column + 1) * kBlockSide, (row + 1) * kBlockSide});
      }
  });
  PixelBox box = view.object_box();
  for (const PixelBox& r : row_box)
    box.include(r);
  return box.clipped(view.width_px(), view.height_px());
}

PictureShader::GridPoint PictureShader::grid_point(const TracedScene& scene, const VisibleSurfaces& view, int column,
                                                   int row) const {
  const int x = column * kBlockSide, y = row * kBlockSide;
  GridPoint point;
  if (view.is_edge(x, y))
    return point;
  if (const ObjectHit& hit = view.object(x, y); hit.samples > 0) {
    const ObjectPoint at = object_point(scene, view.eye(), hit);
    point.kind = GridPoint::Kind::object;
    point.receives = true;
    point.normal = at.normal;
    point.position = at.position;
    point.start = at.start;
    return point;
  }
  const RoomHit room = view.room(x, y);
  if (room.triangle == kNoTriangle)
    return point;
  point.kind = GridPoint::Kind::room;
  point.receives = receives_[static_cast<std::size_t>(row) * view.block_columns() + column] != 0;
  point.position = point.start = view.eye() + room.depth * view.direction(static_cast<float>(x), static_cast<float>(y));
  const glm::vec3 n = scene.room_normals[room.triangle];
  point.normal = glm::dot(n, view.eye() - point.position) < 0.0f ? -n : n;
  return point;
}

bool PictureShader::speaks_for(const GridPoint& g, GridPoint::Kind kind, const glm::vec3& position,
                               const glm::vec3& normal, float radius) {
  if (g.kind != kind || glm::dot(g.normal, normal) < kSameSideCosine)
    return false;
  const glm::vec3 d = position - g.position;
  return kind == GridPoint::Kind::room ? std::fabs(glm::dot(d, normal)) < kSamePlane_m
                                       : glm::dot(d, d) < std::pow(kSamePieceShare * radius, 2.0f);
}

bool PictureShader::stands_by(const GridPoint& g, GridPoint::Kind kind, const glm::vec3& position,
                              const glm::vec3& normal, float radius) {
  const glm::vec3 d = position - g.position;
  if (g.kind != kind || glm::dot(g.normal, normal) <= 0.0f)
    return false;
  return kind == GridPoint::Kind::room ? std::fabs(glm::dot(d, normal)) < kSamePlane_m
                                       : glm::dot(d, d) < std::pow(kSamePieceShare * radius, 2.0f);
}

/// Collects grid points of one kind until they fill the lanes, then finds their shares of the sky.
class PictureShader::ShareTracer {
public:
  ShareTracer(const TracedScene& scene, GridPoint::Kind kind)
      : scene_(scene), casters_(scene.casters()), on_object_(kind == GridPoint::Kind::object) {
    hints_.reset(scene.sky.lights.size());
  }
  /// `words`: where to write what is found; `neighbours`: points that may save rays.
  void add(GridPoint& g, LightWord* words, std::span<const LightWord* const> neighbours) {
    points_.set(count_, g.position, g.normal);
    starts_.set(count_, g.start, g.normal);
    hints_.set(count_, neighbours);
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

void PictureShader::ShareTracer::flush() {
  const int count = std::exchange(count_, 0);
  if (count == 0)
    return;
  const float tnear = on_object_ ? 0.0f : kOwnSurface_m;
  const LightGates& lights = scene_.sky.lights;
  points_.close(count);
  starts_.close(count);
  find_blocked_lights(lights, casters_, points_, starts_, tnear, !on_object_, {}, hints_.verdicts(), blocked_, rays_);
  hints_.reset(lights.size());
  for (int k = 0; k < count; ++k)
    note_verdicts(blocked_, k, words_[k]);
  if (blocked_.lanes == 0 && (!on_object_ || !lights.room_may_block_any()))
    return;
  LaneSums sums;
  sum_lights(lights, blocked_, casters_, points_, starts_, tnear,
             on_object_ ? RoomShadow::on_objects : RoomShadow::where_blocked, {}, sums, rays_);
  for (int k = 0; k < count; ++k)
    for (int c = 0; c < 3; ++c)
      if (const float whole = sums.unblocked[c][k]; whole > 0.0f) {
        target_[k]->before[c] = sums.past_room[c][k] / whole;
        target_[k]->after[c] = sums.past_both[c][k] / whole;
      }
}

/// The mean of the coarse points around a fine one, where these speak for it and agree. `neighbours`: those that were
/// traced and speak for it.
bool PictureShader::interpolate_share(const PixelBox& blocks, int columns, int column, int row, float radius,
                                      std::vector<const LightWord*>& neighbours) {
  GridPoint& g = grid_[static_cast<std::size_t>(row) * columns + column];
  const int dx = (column - blocks.x0) % 2, dy = (row - blocks.y0) % 2;
  Rgb before(0.0f), after(0.0f), low(1.0f), high(0.0f);
  bool all = true;
  neighbours.clear();
  for (int k = 0; k < 4; ++k) {
    const int u = column + (k & 1 ? dx : -dx), v = row + (k & 2 ? dy : -dy);
    const std::size_t i = static_cast<std::size_t>(v) * columns + u;
    if (u >= blocks.x1 || v >= blocks.y1 || !speaks_for(grid_[i], g.kind, g.position, g.normal, radius)) {
      all = false;
      continue;
    }
    const GridPoint& coarse = grid_[i];
    if (coarse.traced)
      neighbours.push_back(&sky_words_[i * sky_word_count_]);
    before += 0.25f * coarse.before;
    after += 0.25f * coarse.after;
    low = glm::min(low, glm::min(coarse.after, coarse.before));
    high = glm::max(high, glm::max(coarse.after, coarse.before));
  }
  if (!all && g.kind == GridPoint::Kind::room)
    neighbours.clear(); // beside an object: what is hidden may be the shadow where both touch
  low = high - low;
  if (!all || std::max({low.r, low.g, low.b}) > kSmoothShare)
    return false;
  g.before = before;
  g.after = after;
  return true;
}

/// What the pixels of the grid show, and which of the sun's lights reach them.
std::uint64_t PictureShader::find_grid_row(const TracedScene& scene, const VisibleSurfaces& view,
                                           const PixelBox& blocks, int row) {
  std::uint64_t rays = 0;
  for (int column = blocks.x0; column < blocks.x1; ++column) {
    const std::size_t i = static_cast<std::size_t>(row) * view.block_columns() + column;
    const GridPoint& g = grid_[i] = grid_point(scene, view, column, row);
    if (sun_groups_ > 0 && g.receives)
      trace_point(scene.sun.lights, scene.casters(), g.start, g.normal,
                  g.kind == GridPoint::Kind::object ? PointOf::object : PointOf::room,
                  {&sun_bits_[i * sun_groups_], sun_groups_}, rays);
  }
  return rays;
}

/// Shares of the coarse points of a tile, every second of a row and column, or of the others.
std::uint64_t PictureShader::trace_tile(const TracedScene& scene, const PixelBox& blocks, const PixelBox& tile,
                                        int columns, bool coarse) {
  std::uint64_t rays = 0;
  std::vector<const LightWord*> neighbours;
  for (const GridPoint::Kind kind : {GridPoint::Kind::object, GridPoint::Kind::room}) {
    ShareTracer tracer(scene, kind);
    for (int row = tile.y0; row < tile.y1; ++row)
      for (int column = tile.x0; column < tile.x1; ++column) {
        const std::size_t i = static_cast<std::size_t>(row) * columns + column;
        GridPoint& g = grid_[i];
        const bool is_coarse = (column - blocks.x0) % 2 == 0 && (row - blocks.y0) % 2 == 0;
        if (g.kind == kind && g.receives && is_coarse == coarse &&
            (coarse ||
             !interpolate_share(blocks, columns, column, row, static_cast<float>(scene.sphere.radius), neighbours)))
          tracer.add(g, &sky_words_[i * sky_word_count_], neighbours);
      }
    tracer.flush();
    rays += tracer.rays();
  }
  return rays;
}

std::uint64_t PictureShader::trace_grid(const TracedScene& scene, const VisibleSurfaces& view, const PixelBox& box) {
  constexpr int kTile = 8; // blocks: its coarse points fill the lanes
  const int columns = view.block_columns();
  grid_.assign(static_cast<std::size_t>(columns) * view.block_rows(), {});
  sky_word_count_ = (scene.sky.lights.size() + 63) / 64;
  sky_words_.resize(grid_.size() * sky_word_count_);
  sun_bits_.assign(grid_.size() * sun_groups_, {});
  std::atomic<std::uint64_t> rays{0};
  // One block more on the far sides: its top left pixel is a corner of the last blocks.
  const PixelBox blocks{box.x0 / kBlockSide, box.y0 / kBlockSide, std::min((box.x1 - 1) / kBlockSide + 2, columns),
                        std::min((box.y1 - 1) / kBlockSide + 2, view.block_rows())};
  tbb::parallel_for(tbb::blocked_range<int>(blocks.y0, blocks.y1, 4), [&](const tbb::blocked_range<int>& range) {
    for (int row = range.begin(); row != range.end(); ++row)
      rays += find_grid_row(scene, view, blocks, row);
  });
  for (const bool coarse : {true, false})
    tbb::parallel_for(0, (blocks.height() + kTile - 1) / kTile, [&](int tile) {
      const int first = blocks.y0 + tile * kTile, last = std::min(first + kTile, blocks.y1);
      for (int column = blocks.x0; column < blocks.x1; column += kTile)
        rays += trace_tile(scene, blocks, {column, first, std::min(column + kTile, blocks.x1), last}, columns, coarse);
    });
  return rays;
}

std::uint64_t PictureShader::shade(const TracedScene& scene, const VisibleSurfaces& view, RenderedFrame& frame) {
  frame.width_px = view.width_px();
  frame.height_px = view.height_px();
  frame.box = affected_box(scene, view);
  frame.origin = scene.origin;
  const std::size_t pixels = static_cast<std::size_t>(frame.box.width()) * frame.box.height();
  for (auto* pass : {&frame.object, &frame.lost_sky, &frame.room})
    pass->assign(pixels, glm::vec4(0.0f));
  frame.surface.assign(pixels, {});
  if (pixels == 0)
    return 0;
  sun_groups_ = scene.sun.lights.direction_blocks().size();
  std::atomic<std::uint64_t> rays{0};
  if (scene.settings.share_visibility)
    rays += trace_grid(scene, view, frame.box);
  const int first = frame.box.y0 / kBlockSide, last = (frame.box.y1 + kBlockSide - 1) / kBlockSide;
  tbb::parallel_for(tbb::blocked_range<int>(first, last), [&](const tbb::blocked_range<int>& range) {
    BlockShader shader(*this, scene, view, frame);
    for (int row = range.begin(); row != range.end(); ++row) {
      for (int column = frame.box.x0 / kBlockSide; column * kBlockSide < frame.box.x1; ++column)
        shader.shade(column, row);
      shader.finish_row();
    }
    rays += shader.rays();
  });
  return rays;
}

} // namespace daylit
