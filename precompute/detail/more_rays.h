#pragma once

// Where a probe's usual rays are too few: much of its light comes through a small opening that few of them find.

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/detail/light_elements.h"
#include "radiosity/exchange_matrix.h"
#include "radiosity/gather.h"
#include "radiosity/solve.h"

namespace daylit::precompute::detail {

/// Radiosity of each element, mean of the channels, for this direct light on the elements, one number each. Errors as
/// solve_radiosity().
Result<std::vector<float>> grey_radiosity(const radiosity::PatchSet& patches, const LightElements& elements,
                                          const radiosity::ExchangeMatrix& exchange, std::vector<float> light,
                                          const radiosity::SolveOptions& options, const Progress& progress);

/// For GatherHits::add_rays(): of each point, which is one of `at`. 0 almost everywhere.
std::vector<std::uint16_t> more_rays(const radiosity::GatherHits& hits, std::span<const glm::dvec3> at,
                                     std::span<const float> radiosity, int rays);

} // namespace daylit::precompute::detail
