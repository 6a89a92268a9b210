#pragma once

#include <vector>

#include "radiosity/first_bounce.h"
#include "scene/sky/sky_partition.h"

namespace daylit::precompute::detail {

/// Light of point-like directions at the nodes becomes node values between which linear interpolation is right in the
/// mean: D' = D - (second difference along azimuth + along altitude) / 12, per solid angle, because interpolation adds
/// 1/12 of it in the mean over all positions. Nodes beside the lit ones get small negative values.
void sharpen_nodes(const SkyPartition& partition, std::vector<radiosity::FirstBounceRow>& rows);

} // namespace daylit::precompute::detail
