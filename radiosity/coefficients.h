#pragma once

// Spherical-harmonic coefficients of the indirect light at points, per column of light.

#include <span>
#include <vector>

#include "radiosity/gather.h"
#include "radiosity/solve.h"

namespace daylit::radiosity {

/// Nine SH coefficients of the indirect radiance at points in the air: L_lm = integral L(x, w) Y_lm(w) dw with
/// L = B / pi of the surface met by the ray (Grosch et al. 2007, eq. 2).
/// Result: [point][coefficient][column], columns as in Radiosity. Errors: interrupted.
Result<std::vector<float>> gather_coefficients(const GatherHits& hits, const Radiosity& radiosity,
                                               const Progress& progress, Bands bands = Bands::low);
/// At some of the points, in the given order.
Result<std::vector<float>> gather_coefficients(const GatherHits& hits, std::span<const std::size_t> points,
                                               const Radiosity& radiosity, const Progress& progress,
                                               Bands bands = Bands::low);

/// The same from the direct light, without the radiosity of the room: adjoint solves for the 9 rows of every point.
/// Cheaper where the points are fewer than a ninth of the sky regions. `report` as solve_adjoint().
Result<std::vector<float>> adjoint_coefficients(const GatherHits& hits, const PatchSet& set,
                                                const ExchangeMatrix& exchange, const FirstBounce& light,
                                                const SolveOptions& solve, const Progress& progress,
                                                SolveReport* report = nullptr, Bands bands = Bands::low);

} // namespace daylit::radiosity
