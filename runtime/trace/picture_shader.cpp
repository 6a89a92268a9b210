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

std::uint64_t PictureShader::trace_grid(const TracedScene& scene, const VisibleSurfaces& view, const PixelBox& box) {
  const ShadowCasters casters = scene.casters();
  const int columns = view.block_columns();
  const std::size_t groups = sky_groups_ + sun_groups_;
  grid_.assign(static_cast<std::size_t>(columns) * view.block_rows(), {});
  bits_.resize(grid_.size() * groups);
  std::atomic<std::uint64_t> rays{0};
  const auto trace = [&](int column, int row, std::uint64_t& traced) {
    const int x = column * kBlockSide, y = row * kBlockSide;
    const std::size_t i = static_cast<std::size_t>(row) * columns + column;
    GridPoint& point = grid_[i];
    glm::vec3 start;
    PointOf kind = PointOf::object;
    if (view.is_edge(x, y))
      return;
    if (const ObjectHit& hit = view.object(x, y); hit.samples > 0) {
      const ObjectPoint at = object_point(scene, view.eye(), hit);
      point = {GridPoint::Kind::object, at.normal, at.position};
      start = at.start;
    } else {
      const RoomHit room = receives_[i] ? view.room(x, y) : RoomHit{};
      if (room.triangle == kNoTriangle)
        return;
      start = view.eye() + room.depth * view.direction(static_cast<float>(x), static_cast<float>(y));
      const glm::vec3 n = scene.room_normals[room.triangle];
      point = {GridPoint::Kind::room, glm::dot(n, view.eye() - start) < 0.0f ? -n : n, start};
      kind = PointOf::room;
    }
    const std::span<LightBits> bits(&bits_[i * groups], groups);
    trace_point(scene.sky.lights, casters, start, point.normal, kind, bits.first(sky_groups_), traced);
    trace_point(scene.sun.lights, casters, start, point.normal, kind, bits.last(sun_groups_), traced);
  };
  // One block more on the far sides: its top left pixel is a corner of the last blocks.
  const int last_column = std::min(box.x1 / kBlockSide + 1, columns),
            last_row = std::min(box.y1 / kBlockSide + 1, view.block_rows());
  tbb::parallel_for(tbb::blocked_range<int>(box.y0 / kBlockSide, last_row), [&](const tbb::blocked_range<int>& range) {
    std::uint64_t traced = 0;
    for (int row = range.begin(); row != range.end(); ++row)
      for (int column = box.x0 / kBlockSide; column < last_column; ++column)
        trace(column, row, traced);
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
  sky_groups_ = scene.sky.lights.direction_blocks().size();
  sun_groups_ = scene.sun.lights.direction_blocks().size();
  std::atomic<std::uint64_t> rays{0};
  if (scene.settings.share_visibility)
    rays += trace_grid(scene, view, frame.box);
  const int first = frame.box.y0 / kBlockSide, last = (frame.box.y1 + kBlockSide - 1) / kBlockSide;
  tbb::parallel_for(tbb::blocked_range<int>(first, last), [&](const tbb::blocked_range<int>& range) {
    BlockShader shader(*this, scene, view, frame);
    for (int row = range.begin(); row != range.end(); ++row)
      for (int column = frame.box.x0 / kBlockSide; column * kBlockSide < frame.box.x1; ++column)
        shader.shade(column, row);
    rays += shader.rays();
  });
  return rays;
}

} // namespace daylit
