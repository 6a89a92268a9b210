#pragma once

#include <array>
#include <span>
#include <vector>

#include "radiosity/first_bounce.h"
#include "radiosity/form_factors.h"
#include "radiosity/work_store.h"

namespace daylit::radiosity {

/// Radiosity (W/m^2 per unit region radiance, or any unit x sr) of every patch for every column.
struct Radiosity {
  std::size_t patches = 0, columns = 0; ///< columns = 3 * regions, channel-major: channel * regions + region
  std::vector<float> b;                 ///< [patch][column]
  /// The channel that each channel is a copy of: a grey room behind clear panes is solved once, not three times.
  std::array<int, 3> copy_of = {0, 1, 2};
  const float* row(std::size_t patch) const { return b.data() + patch * columns; }
};

enum class SolveMethod { automatic, conjugate_gradients, cholesky };

struct SolveOptions {
  double tolerance = 1e-5; ///< relative residual of each column, 2-norm
  int max_iterations = 2000;
  SolveMethod method = SolveMethod::automatic; ///< the cheaper one by operations
  WorkStore* store = nullptr;                  ///< finished panels of columns are taken from it and kept in it
};

struct SolveReport {
  int iterations = 0;          ///< largest over the columns
  double worst_residual = 0;   ///< largest relative residual of any column, recomputed from the solution
  std::vector<float> residual; ///< the same per solved column
  int factorised = 0;          ///< channels solved directly; 0 iterations there
  int channels = 0;            ///< solved; the others are copies (bound 0)
  double seconds = 0;          ///< wall
  double cpu_seconds = 0;      ///< processor time of the process meanwhile, all threads

  /// Another solution of the same problem: other channels or columns.
  void add(const SolveReport& other);
};

/// B = rho (H + F B) for all regions and channels together, on the symmetric form z - D^-1/2 G D^-1/2 z =
/// D^1/2 rho H with D = A / rho, B = D^-1/2 z: by conjugate gradients, one matrix product for a panel of columns, or by
/// a Cholesky factor where it serves many columns. Residuals are recomputed from the solution either way.
/// Panels have a fixed width, so the bits do not depend on the number of threads.
/// Errors: interrupted; value_invalid when a column does not converge (reflectance 1 in a closed room).
Result<Radiosity> solve_radiosity(const PatchSet& set, const ExchangeMatrix& exchange, const FirstBounce& light,
                                  const SolveOptions& options, const Progress& progress, SolveReport* report = nullptr);

/// Volume to light: for rows of receiver weights w (what a receiver takes from each patch's radiosity), the weights
/// h with sum_i w_i B_i = sum_i h_i H_i for any direct irradiance H. The matrix is symmetric, so it is the same solver;
/// cheaper where there are fewer receivers than sky regions (Hasan et al. 2006).
/// `weights`: [row][patch]; result: [row][patch] for reflectances of `channel`. Errors as solve_radiosity().
Result<std::vector<float>> solve_adjoint(const PatchSet& set, const ExchangeMatrix& exchange,
                                         std::span<const float> weights, std::size_t rows, int channel,
                                         const SolveOptions& options, const Progress& progress,
                                         SolveReport* report = nullptr);

/// Which channel each channel is a copy of: same reflectances everywhere and same direct light.
std::array<int, 3> equal_channels(const PatchSet& set, const FirstBounce& light);

} // namespace daylit::radiosity
