#pragma once

// Regions of the sky that are small where the volume changes with the direction and large where it does not: the oracle
// that Grosch et al. (2007) leave as future work. A coarse bake of the room tells how the coefficients at points in its
// air depend on the direction; the sphere is then cut, again and again, where a cut takes away most of that change.

#include <optional>
#include <span>
#include <string>

#include "scene/core/program.h"
#include "scene/core/result.h"
#include "scene/room/room_formats.h"
#include "scene/sky/sky_partition.h"

namespace daylit::precompute {

/// "adaptive:N" for this room, or what SkyPartition::parse() reads. Errors of it and of the coarse bake; usage where N
/// is not in 16..8192.
Result<SkyPartition> sky_for(const RoomFile& room, const std::string& regions, const Progress& progress);

/// Whether `regions` reads as one of these, without a room to look at.
Result<void> check_regions(const std::string& regions);
/// The N of "adaptive:N"; nothing for another kind.
std::optional<int> adaptive_regions(const std::string& regions);

/// The cells that regions are made of: 64 bands of equal solid angle of 128 cells.
SkyPartition adaptive_cells();

/// `response`: [cell][width], what radiance 1 in a cell gives. Rectangles of cells, starting from the two hemispheres;
/// each step makes the cut, at any line of any rectangle, that lowers the squared difference between the cells and the
/// mean of their rectangle most, times the solid angle of the rectangle.
Result<SkyPartition> cut_where_it_changes(std::span<const float> response, std::size_t width, int regions);

} // namespace daylit::precompute
