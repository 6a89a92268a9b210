#pragma once

// The light that the sky throws on the surfaces of a room: a sparse matrix from sky regions to pieces of surface. What
// a piece sees of the sky through a window is a patch of neighbouring directions, so its weights lie in a few runs.

#include <cstdint>
#include <span>
#include <vector>

#include "scene/result.h"
#include "scene/rgb_image.h"

namespace daylit {

/// Rows are pieces of surface, or three per piece (all red, all green, all blue) where panes are tinted.
struct FirstLight {
  struct Run {
    std::uint32_t first_region = 0, count = 0;
  };
  std::vector<float> scale;                ///< of each row
  std::vector<std::uint32_t> first_run;    ///< of each row, and one more: the end
  std::vector<std::uint32_t> first_weight; ///< the same
  std::vector<Run> run;
  std::vector<std::uint16_t> weight; ///< half floats, run after run

  std::size_t rows() const { return scale.size(); }
  std::size_t bytes() const;
};

/// scale * sum weight * radiance for each of `pieces` pieces. Independent of the thread count.
std::vector<Rgb> received(const FirstLight& light, std::size_t pieces, std::span<const Rgb> region_radiance);

/// Runs lie inside the sky and do not overlap within a row, offsets rise, numbers are finite.
Result<void> check_first_light(const FirstLight& light, std::size_t pieces, int regions);

} // namespace daylit
