#pragma once

// Final gather: irradiance at points on surfaces (or anywhere else with a normal) from a solved radiosity.

#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "radiosity/patches.h"
#include "radiosity/solve.h"
#include "scene/core/program.h"

namespace daylit::bench {

struct SurfacePoint {
  glm::dvec3 position{0.0}; ///< metres, relative to SurfaceMesh::origin; on a surface or in the air
  glm::dvec3 normal{0.0};   ///< unit
};

struct SurfaceOptions {
  int partial_rays = 256; ///< rays to a patch of which some, but not all, of the first 16 are blocked
};

/// E = sum_j F_j V_j B_j: exact point-to-polygon form factors (Lambert), visibility by stratified rays weighted with
/// the kernel. No smoothing: a receiver closer to a patch's edge than the patches are long sees the steps between
/// them. Light straight from the sky is DirectSky's (scene/sky/direct_sky.h).
/// Result: [point][column], columns as in radiosity::Radiosity. Errors: interrupted.
Result<std::vector<float>> surface_irradiance(std::span<const SurfacePoint> points, const radiosity::PatchSet& set,
                                              const RayScene& facets, const radiosity::Radiosity& solved,
                                              const SurfaceOptions& options, const Progress& progress);

} // namespace daylit::bench
