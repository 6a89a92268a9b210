#pragma once

// What enters a room must be absorbed or leave again.

#include "radiosity/row_closure.h"
#include "radiosity/solve.h"

namespace daylit::radiosity {

/// All columns and channels together, in the unit of area times radiosity.
struct EnergyBalance {
  double entering = 0;  ///< flux through the openings that meets a surface
  double absorbed = 0;  ///< sum (1 - rho) A E
  double leaving = 0;   ///< flux that goes back out through the openings
  double imbalance = 0; ///< |entering - absorbed - leaving| / entering
  double unclosed = 0;  ///< what the imbalance would be without close_rows(); 0 where that is not known
};

/// `closed`: what close_rows() found before the solution.
EnergyBalance audit_energy(const PatchSet& set, const ExchangeMatrix& exchange, const FirstBounce& light,
                           const Radiosity& radiosity, const RowClosure* closed = nullptr);

} // namespace daylit::radiosity
