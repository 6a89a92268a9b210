#pragma once

// From the factors of all probe clusters to the basis that is stored.

#include <span>
#include <vector>

#include "precompute/detail/probe_cluster.h"
#include "scene/volume/compact_basis.h"

namespace daylit::precompute::detail {

/// Chooses for the components of all clusters together how each is stored: the least bytes whose squared error, with
/// what the sketches missed, is at most `allowed`. Sketches that missed most of it leave the storage a part of its own:
/// finer numbers would not help. Band 4 follows at the same error per byte, so that it changes nothing of the nine.
void choose_storage(std::vector<ProbeCluster>& clusters, const Measure& measure, double allowed);

/// `sigma`: unit of each source's irradiance. Point p is probe probe_of_point[p].
CompactBasis assemble(const std::vector<ProbeCluster>& clusters, const SurfaceLight& light,
                      const std::vector<float>& sigma, std::span<const std::size_t> probe_of_point);

} // namespace daylit::precompute::detail
