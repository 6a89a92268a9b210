#include "runtime/trace/picture_shader.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "runtime/trace/block_shader.h"

namespace daylit {

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

/// Shares of the points of one kind in a tile of grid points that fill the lanes.
std::uint64_t PictureShader::trace_tile(const TracedScene& scene, const PixelBox& tile, GridPoint::Kind kind,
                                        int columns) {
  PointBlock points, starts;
  GridPoint* target[kLanes];
  int count = 0;
  std::uint64_t rays = 0;
  const bool on_object = kind == GridPoint::Kind::object;
  const float tnear = on_object ? 0.0f : kOwnSurface_m;
  const ShadowCasters casters = scene.casters();
  for (int row = tile.y0; row < tile.y1; ++row)
    for (int column = tile.x0; column < tile.x1; ++column) {
      const std::size_t i = static_cast<std::size_t>(row) * columns + column;
      GridPoint& g = grid_[i];
      if (g.kind != kind || !g.receives)
        continue;
      points.set(count, g.position, g.normal);
      starts.set(count, g.start, g.normal);
      target[count++] = &g;
      if (sun_groups_ > 0)
        trace_point(scene.sun.lights, casters, g.start, g.normal, on_object ? PointOf::object : PointOf::room,
                    {&sun_bits_[i * sun_groups_], sun_groups_}, rays);
    }
  if (count == 0)
    return rays;
  points.close(count);
  starts.close(count);
  thread_local BlockedLights blocked; // keeps its memory
  find_blocked_lights(scene.sky.lights, casters, points, starts, tnear, !on_object, {}, blocked, rays);
  if (blocked.lanes == 0 && (!on_object || !scene.sky.lights.room_may_block_any()))
    return rays;
  LaneSums sums;
  sum_lights(scene.sky.lights, blocked, casters, points, starts, tnear,
             on_object ? RoomShadow::on_objects : RoomShadow::where_blocked, {}, sums, rays);
  for (int k = 0; k < count; ++k)
    for (int c = 0; c < 3; ++c)
      if (const float whole = sums.unblocked[c][k]; whole > 0.0f) {
        target[k]->before[c] = sums.past_room[c][k] / whole;
        target[k]->after[c] = sums.past_both[c][k] / whole;
      }
  return rays;
}

std::uint64_t PictureShader::trace_grid(const TracedScene& scene, const VisibleSurfaces& view, const PixelBox& box) {
  const int columns = view.block_columns();
  grid_.assign(static_cast<std::size_t>(columns) * view.block_rows(), {});
  sun_bits_.assign(grid_.size() * sun_groups_, {});
  std::atomic<std::uint64_t> rays{0};
  // One block more on the far sides: its top left pixel is a corner of the last blocks.
  const PixelBox blocks{box.x0 / kBlockSide, box.y0 / kBlockSide, std::min((box.x1 - 1) / kBlockSide + 2, columns),
                        std::min((box.y1 - 1) / kBlockSide + 2, view.block_rows())};
  const int tiles = (blocks.height() + kBlockSide - 1) / kBlockSide;
  tbb::parallel_for(tbb::blocked_range<int>(0, tiles), [&](const tbb::blocked_range<int>& range) {
    std::uint64_t traced = 0;
    for (int tile = range.begin(); tile != range.end(); ++tile) {
      const int first = blocks.y0 + tile * kBlockSide, last = std::min(first + kBlockSide, blocks.y1);
      for (int row = first; row < last; ++row)
        for (int column = blocks.x0; column < blocks.x1; ++column)
          grid_[static_cast<std::size_t>(row) * columns + column] = grid_point(scene, view, column, row);
      for (int column = blocks.x0; column < blocks.x1; column += kBlockSide)
        for (const GridPoint::Kind kind : {GridPoint::Kind::object, GridPoint::Kind::room})
          traced += trace_tile(scene, {column, first, std::min(column + kBlockSide, blocks.x1), last}, kind, columns);
    }
    rays += traced;
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
