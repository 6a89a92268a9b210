#pragma once

// Daylight coefficients of a volume at points, as a Radiance matrix.

#include <span>

#include "precompute/probe_text.h"
#include "scene/core/program.h"
#include "scene/room/ray_scene.h"
#include "scene/volume/radiance_matrix.h"
#include "scene/volume/volume.h"

namespace daylit::precompute {

struct MatrixContent {
  bool coefficients = false; ///< nine rows per point, L_lm; else one, the irradiance on its normal
  bool total = false;        ///< with the light that comes straight through the windows (irradiance only)
};

/// Column p is what the points get from a sky of radiance 1 in patch p alone; the product with a vector of patch
/// radiances is combine() for that sky, interpolated as daylit-probe does. Linear: no window against ringing.
/// Error: a point has no light field, or the matrix would have more than 2^28 values.
Result<RadianceMatrix> daylight_matrix(const BasisVolume& volume, const LightFieldSampler& sampler,
                                       const RayScene& scene, std::span<const ProbePoint> points,
                                       const ReinhartPatches& patches, MatrixContent content, const Progress& progress);

} // namespace daylit::precompute
