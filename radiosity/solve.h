#pragma once

#include <cstdint>
#include <vector>

#include "radiosity/first_bounce.h"
#include "radiosity/form_factors.h"

namespace daylit::radiosity {

/// Radiosity (W/m^2 per unit region radiance, or any unit x sr) of every element for every column.
struct Radiosity {
  std::size_t elements = 0, columns = 0; ///< columns = 3 * regions, channel-major: channel * regions + region
  std::vector<float> b;                  ///< [element][column]
  const float* row(std::size_t element) const { return b.data() + element * columns; }
};

struct SolveOptions {
  double tolerance = 1e-5; ///< relative residual of each column, 2-norm
  int max_iterations = 2000;
};

struct SolveReport {
  int iterations = 0;        ///< largest over the columns
  double worst_residual = 0; ///< largest relative residual of any column, recomputed from the solution
  double seconds = 0;
};

/// B = rho (H + F B) for all regions and channels together, by conjugate gradients on the symmetric form
/// z - D^-1/2 G D^-1/2 z = D^1/2 rho H with D = A / rho, B = D^-1/2 z; one matrix product serves a panel of columns.
/// Panels have a fixed width, so the bits do not depend on the number of threads.
/// Errors: interrupted; value_invalid when a column does not converge (reflectance 1 in a closed room).
Result<Radiosity> solve_radiosity(const ElementSet& set, const ExchangeMatrix& exchange, const FirstBounce& light,
                                  const SolveOptions& options, const Progress& progress, SolveReport* report = nullptr);

/// Energy audit per unit of entering flux, all columns and channels together.
struct EnergyBalance {
  double entering = 0;      ///< flux through the openings that meets a surface
  double absorbed = 0;      ///< sum (1 - rho) A E
  double leaving = 0;       ///< flux that goes back out through the openings
  double imbalance = 0;     ///< |entering - absorbed - leaving| / entering
  double worst_closure = 0; ///< largest |row sum of F + opening - 1| over the elements
  double mean_closure = 0;  ///< area mean of the same, signed
};
EnergyBalance audit_energy(const ElementSet& set, const ExchangeMatrix& exchange, const FirstBounce& light,
                           const Radiosity& radiosity);

} // namespace daylit::radiosity
