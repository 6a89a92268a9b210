#pragma once

// The light that the sky throws on the surfaces of a room: a sparse matrix from sky nodes to elements. What an element
// sees of the sky through a window is a patch of neighbouring directions, so its weights lie in blocks of eight nodes,
// which begin at multiples of eight (block compressed sparse rows).

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"

namespace daylit {

/// Rows are elements (sources). Where panes are tinted each source has three scales, all red, all green, all blue; its
/// rows are three as well, in the same order, or one for the three where all that it sees has the same tint.
struct FirstLight {
  static constexpr std::size_t kBlock = 8;

  std::uint32_t colours = 1;              ///< scales per source: 1 or 3
  std::vector<float> scale;               ///< scale k is for row k, or k modulo the number of rows
  std::vector<std::uint32_t> first_block; ///< of each row, and one more: the end
  std::vector<std::uint16_t> block;       ///< nodes from kBlock * block on (no sky has 2^19); increasing within a row
  std::vector<std::uint16_t> weight;      ///< half floats, kBlock for each block; 0 for nodes beyond the last

  std::size_t rows() const { return first_block.size() - 1; }
  std::size_t sources() const { return scale.size() / colours; }
  std::size_t bytes() const;
};

/// irradiance[source, c] = scale[c, source] sum_node weight[row, node] radiance[node, c]. Independent of the thread
/// count.
std::vector<Rgb> irradiance_of_sources(const FirstLight& light, std::span<const Rgb> node_radiance);

/// Calls visit(node, scale * weight) for the weights of the row of scale k that are not 0, nodes increasing.
void for_each_weight(const FirstLight& light, std::size_t k,
                     const std::function<void(std::size_t node, float weight)>& visit);

/// The nodes that light anything: [node] is 1.
std::vector<std::uint8_t> lit_regions(const FirstLight& light, std::size_t regions);

/// Blocks lie inside the sky and rise within a row, offsets rise, numbers are finite, none is beyond the last node.
Result<void> check_first_light(const FirstLight& light, int regions);

} // namespace daylit
