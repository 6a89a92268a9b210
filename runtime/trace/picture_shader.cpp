#include "runtime/trace/picture_shader.h"

#include <atomic>

#include "runtime/trace/block_shader.h"
#include "scene/core/parallel.h"

namespace daylit {

/// Marks the blocks that a light could reach only through the objects' sphere; the box holds them and the objects.
PixelBox PictureShader::affected_box(const TracedScene& scene, const VisibleSurfaces& view) {
  const ShadowCasters casters = scene.casters();
  const int columns = view.block_columns(), rows = view.block_rows();
  receives_.assign(static_cast<std::size_t>(columns) * rows, 0);
  std::vector<PixelBox> row_box(static_cast<std::size_t>(rows));
  parallel_for(tbb::blocked_range<int>(0, rows, 8), [&](const tbb::blocked_range<int>& range) {
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

/// What the grid is laid over.
SampledPicture PictureShader::sampled_picture(const TracedScene& scene, const VisibleSurfaces& view,
                                              const PixelBox& box) {
  outline_.clear();
  for (std::size_t k = 0; k < view.edge_pixels(); ++k)
    outline_.push_back(view.edge_pixel(k));
  const ShadowCasters casters = scene.casters();
  return {view.block_columns(),
          view.block_rows(),
          box,
          casters.radius,
          view.radius_px(casters.centre, casters.radius),
          scene.sky.size(),
          scene.sun.size(),
          outline_};
}

std::uint64_t PictureShader::shade(const TracedScene& scene, const VisibleSurfaces& view, RenderedFrame& frame) {
  frame.width_px = view.width_px();
  frame.height_px = view.height_px();
  frame.box = affected_box(scene, view);
  frame.origin = scene.origin;
  const std::size_t pixels = static_cast<std::size_t>(frame.box.width()) * frame.box.height();
  for (auto* pass : {&frame.object, &frame.lost_sky, &frame.room})
    pass->resize(pixels);
  frame.surface.resize(pixels);
  frame.shows.assign(receives_.size(), 0);
  if (pixels == 0)
    return 0;
  const RayVisibility visibility(scene, view, receives_);
  std::atomic<std::uint64_t> rays{0};
  if (scene.settings.use_grid)
    rays += grid_.evaluate(visibility, sampled_picture(scene, view, frame.box));
  const int first = frame.box.y0 / kBlockSide, last = (frame.box.y1 + kBlockSide - 1) / kBlockSide;
  parallel_for(tbb::blocked_range<int>(first, last), [&](const tbb::blocked_range<int>& range) {
    BlockShader shader(grid_, visibility, receives_, scene, view, frame);
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
