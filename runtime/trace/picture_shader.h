#pragma once

// Light on what the pixels show: visibility shared between neighbours first, then block by block.

#include <cstdint>
#include <vector>

#include "runtime/trace/share_grid.h"

namespace daylit {

/// Keeps its memory from frame to frame.
class PictureShader {
public:
  /// Fills the frame; returns how many shadow rays it took.
  std::uint64_t shade(const TracedScene& scene, const VisibleSurfaces& view, RenderedFrame& frame);

private:
  PixelBox affected_box(const TracedScene& scene, const VisibleSurfaces& view);

  std::vector<std::uint8_t> receives_; ///< per block of the picture: some light may lose its way to it
  ShareGrid grid_;
};

} // namespace daylit
