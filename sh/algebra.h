#pragma once

// Inner products and products of functions given by coefficients, and how many bands a function needs.

#include <span>
#include <vector>

#include "sh/error.h"
#include "sh/transform.h"

namespace daylit::sh {

/// Integral of f g over the sphere = sum of products of coefficients (one channel; the shorter series decides).
double inner_product(std::span<const double> f, std::span<const double> g);

/// Coefficients of f g up to `degree`, exact: both are synthesised on a Gauss-Legendre grid that integrates
/// deg f + deg g + degree, multiplied there and analysed. O(n^3) instead of the O(n^5) of Clebsch-Gordan sums.
Expected<std::vector<double>> product(std::span<const double> f, std::span<const double> g, int degree);

/// Integral of f^2 within each band, channels added.
Expected<std::vector<double>> band_energies(std::span<const double> coefficients, int channels);

/// How far to go, and what that omits.
struct OrderChoice {
  int degree = 0;
  double rms_left = 0.0; ///< root mean square over the sphere of what the bands above contribute; exact
  double max_left = 0.0; ///< bound, everywhere, on what the known bands above contribute
};

/// Smallest degree at which (kernel * f) is known to `tolerance` (root mean square, absolute). `bands`: factors of the
/// kernel (all 1 for f itself), `energies`: of the known bands of f, `rest_energy`: integral of f^2 above them.
/// When even all known bands do not suffice the result is the last band and rms_left says what is missing.
Expected<OrderChoice> choose_degree(std::span<const double> bands, std::span<const double> energies, double rest_energy,
                                    double tolerance);

struct AdaptiveAnalysis {
  OrderChoice choice;
  std::vector<double> coefficients; ///< up to choice.degree
  double total_energy = 0.0;        ///< integral of f^2 by the quadrature of the grid
};

/// Analysis that doubles its degree until the energy above it is below (relative_tolerance)^2 of the whole, or the
/// grid resolves no more (2 degree <= exact_degree); bands that are not needed are dropped from the result.
Expected<AdaptiveAnalysis> analyse_to_tolerance(const RingGrid& grid, const ImageView<const float>& image,
                                                double relative_tolerance);

} // namespace daylit::sh
