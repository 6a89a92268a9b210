#pragma once

#include <cstdint>

#include "radiosity/exchange_matrix.h"
#include "radiosity/patches.h"
#include "radiosity/work_store.h"
#include "scene/core/program.h"

namespace daylit::radiosity {

struct ExchangeReport {
  std::uint64_t facing_pairs = 0;
  std::uint64_t near_pairs = 0;     ///< by contour integral
  std::uint64_t clear_pairs = 0;    ///< nothing can stand between them: no ray (bound 0)
  std::uint64_t low_rank_pairs = 0; ///< of those, stored as products
  std::uint64_t hidden_pairs = 0;   ///< one obstacle hides them from each other: no ray (bound 0)
  std::uint64_t sampled_pairs = 0;  ///< decided by rays
  std::uint64_t black_pairs = 0;    ///< left out: neither reflects (bound 0)
  std::uint64_t rays = 0;
  std::size_t dense_blocks = 0, low_rank_blocks = 0, bytes = 0;
  double mean_rank = 0;
  double seconds = 0;
};

struct ExchangeOptions {
  /// Visibility rays per unit of form factor: a partly hidden pair of form factor F gets about this times F (at least
  /// 4, at most 4096). The error of a row's sum falls with its root or faster.
  double visibility_rays = 229376;
  double low_rank_tolerance = 1e-4; ///< of the Frobenius norm of each low-rank block
  std::size_t max_bytes = std::size_t{6} << 30;
  bool skip_black = false;    ///< leave out pairs that both reflect nothing: right when no surface emits
  WorkStore* store = nullptr; ///< finished work is taken from it and kept in it
};

/// Exchange areas of all pairs. Unoccluded part: contour integral for pairs closer than a few diameters or cut by each
/// other's plane, 3 x 3 Gauss points beyond (1.1e-4 rms, 3e-3 the worst pair). Visibility: low-discrepancy rays
/// between the two triangles weighted by the same kernel, in proportion to the pair's form factor. Pairs with
/// nothing between them need no ray, nor do those that one face hides from each other; clusters that are far apart with
/// nothing between them need no entries: they are stored as low-rank products. `room`: the surfaces that the mesh was
/// made of; `rays`: the same. Errors: limit_exceeded (storage), interrupted.
Result<ExchangeMatrix> exchange_areas(const PatchSet& set, const SurfaceMesh& mesh, const Room& room,
                                      const RayScene& rays, const ExchangeOptions& options, const Progress& progress,
                                      ExchangeReport* report = nullptr);

/// Bytes that exchange_areas() is expected to store; none is computed. Error: limit_exceeded, as above.
Result<double> exchange_bytes(const PatchSet& set, const SurfaceMesh& mesh, const Room& room,
                              const ExchangeOptions& options);

} // namespace daylit::radiosity
