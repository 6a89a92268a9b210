#pragma once

// Where to sample the sphere, and with which weight. Latitudes are rings of equidistant azimuths.

#include <vector>

#include "sh/error.h"

namespace daylit::sh {

/// Largest degree that any function of this component accepts.
inline constexpr int kMaxDegree = 20000;

/// Nodes of a rule for the integral over cos(theta) in -1..1, north to south. Symmetric to the last bit.
struct LatitudeRule {
  std::vector<double> theta; ///< colatitude, radians, ascending
  std::vector<double> cos_theta;
  std::vector<double> sin_theta;
  std::vector<double> weight; ///< sums to 2
  int exact_degree = 0;       ///< polynomials in cos(theta) up to this degree are integrated exactly
};

/// Gauss-Legendre: `count` nodes, exact to degree 2 count - 1. Newton iteration on P_n(cos theta) in theta, with the
/// difference form of the recurrence, so that nodes near the poles keep full relative accuracy.
Expected<LatitudeRule> gauss_legendre(int count);

/// Fejer's first rule: theta_i = (i + 1/2) pi / count, the rows of an equirectangular image; exact to degree count - 1.
Expected<LatitudeRule> fejer(int count);

/// Clenshaw-Curtis: theta_i = i pi / (count - 1), poles included; exact to degree count - 1. At least 2 nodes.
Expected<LatitudeRule> clenshaw_curtis(int count);

/// Rings of a full sphere. Sample j of a ring lies at azimuth first_azimuth + turn * 2 pi j / longitudes.
struct RingGrid {
  std::vector<double> cos_theta; ///< one per ring, north to south
  std::vector<double> sin_theta;
  std::vector<double> weight_sr; ///< solid angle of one sample of the ring; all samples together: 4 pi
  int longitudes = 0;
  double first_azimuth = 0.0; ///< radians
  int turn = 1;               ///< +1: azimuth grows with the column, -1: it falls
  int exact_degree = 0;       ///< spherical polynomials up to this degree are integrated exactly

  int rings() const { return int(cos_theta.size()); }
  std::size_t samples() const { return cos_theta.size() * std::size_t(longitudes); }
};

/// Smallest grid on which analysis inverts synthesis up to `degree`: degree + 1 rings of at least 2 degree + 2
/// samples (rounded up to a fast FFT length), or of `longitudes` samples when that is not 0.
Expected<RingGrid> gauss_legendre_grid(int degree, int longitudes = 0);

/// Pixel centres of an equirectangular image (docs/design.md: the centre column looks along +x, azimuth grows to the
/// left), with Fejer weights. Analysis inverts synthesis for degrees up to (height - 1) / 2.
Expected<RingGrid> equirectangular_grid(int width, int height);

/// Clenshaw-Curtis rings, first sample at azimuth 0.
Expected<RingGrid> clenshaw_curtis_grid(int rings, int longitudes);

} // namespace daylit::sh
