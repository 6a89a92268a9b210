#pragma once

#include <cstdint>
#include <vector>

#include "radiosity/elements.h"
#include "scene/program.h"

namespace daylit::radiosity {

/// Exchange areas G_ij = A_i F_ij = A_j F_ji in m^2, dense, exactly symmetric, zero diagonal.
struct ExchangeMatrix {
  std::size_t size = 0;
  std::vector<float> g; ///< size x size, row-major
  const float* row(std::size_t i) const { return g.data() + i * size; }
};

struct ExchangeReport {
  std::uint64_t facing_pairs = 0;
  std::uint64_t near_pairs = 0;    ///< by contour integral
  std::uint64_t clear_pairs = 0;   ///< nothing can stand between their blocks: no ray (bound 0)
  std::uint64_t partial_pairs = 0; ///< some of the first rays blocked
  std::uint64_t rays = 0;
  double seconds = 0;
};

struct ExchangeOptions {
  int partial_rays = 64; ///< rays for a pair of which some, but not all, of the first 16 are blocked
  std::size_t max_bytes = std::size_t{6} << 30; ///< dense storage limit
};

/// Unoccluded part: contour integral for pairs closer than a few diameters or cut by each other's plane, 3 x 3 Gauss
/// points beyond. Visible share: stratified rays between the two triangles weighted by the same kernel.
/// Blocks of elements with nothing between them need no ray. `occluders` holds the same surfaces as the mesh, in world
/// coordinates (fewer and larger triangles trace faster).
/// Errors: limit_exceeded (dense storage), interrupted.
Result<ExchangeMatrix> exchange_areas(const ElementSet& set, const PatchMesh& mesh, const RayScene& occluders,
                                      const ExchangeOptions& options, const Progress& progress,
                                      ExchangeReport* report = nullptr);

} // namespace daylit::radiosity
