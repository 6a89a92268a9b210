#pragma once

// Light on what the pixels show: the sampling grid first, then block by block.

#include <cstdint>
#include <vector>

#include "runtime/shading/sampling_grid.h"
#include "runtime/trace/ray_visibility.h"

namespace daylit {

/// Keeps its memory from frame to frame.
class PictureShader {
public:
  /// Fills the frame; returns how many shadow rays it took.
  std::uint64_t shade(const TracedScene& scene, const VisibleSurfaces& view, RenderedFrame& frame);

private:
  PixelBox affected_box(const TracedScene& scene, const VisibleSurfaces& view);
  SampledPicture sampled_picture(const TracedScene& scene, const VisibleSurfaces& view, const PixelBox& box);

  std::vector<std::uint8_t> receives_; ///< per block of the picture: some light may lose its way to it
  std::vector<glm::ivec2> outline_;    ///< of the objects, pixels
  SamplingGrid grid_;
};

} // namespace daylit
