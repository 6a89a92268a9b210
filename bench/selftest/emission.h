#pragma once

// Surfaces that give off light of their own: what drives a closed room, where no sky can.

#include <span>
#include <vector>

#include "radiosity/first_bounce.h"
#include "radiosity/form_factors.h"
#include "radiosity/solve.h"

namespace daylit::bench {

/// G times `width` columns given per patch, row-major; the same layout returned. m^2 times the unit of the columns.
std::vector<float> exchange_product(const radiosity::ExchangeMatrix& exchange, std::span<const float> columns,
                                    std::size_t width);

/// Irradiance of every patch by emitting patches, one column (region 0), ready for solve_radiosity:
/// A_i H_i = sum_j G_ij M_j. `exitance` M: W/m^2 (or lm/m^2) per patch and channel. The room counts as closed:
/// `opening` is 0. Error: as many values as patches are needed.
Result<radiosity::FirstBounce> emitted_light(const radiosity::PatchSet& set, const radiosity::ExchangeMatrix& exchange,
                                             std::span<const Rgb> exitance);

/// Adds the emitters' own exitance to a solved reflected radiosity, in every column: what a receiver sees of them.
void add_exitance(std::span<const Rgb> exitance, radiosity::Radiosity& radiosity);

} // namespace daylit::bench
