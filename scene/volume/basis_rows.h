#pragma once

// Sums over the rows of constant regions.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/image/rgb_image.h"

namespace daylit::detail {

/// Of the region of each row.
std::vector<Rgb> radiance_of_rows(std::span<const std::int32_t> region, std::span<const Rgb> region_radiance);

/// field[probe, lm, c] += sum_r radiance[r, c] basis[r, probe, lm, c]. Rows of radiance 0 are not read. Returns how
/// many are. Independent of the thread count.
std::size_t add_basis_rows(std::span<const float> basis, std::span<const Rgb> radiance,
                           std::span<std::array<Rgb, 9>> field);

} // namespace daylit::detail
