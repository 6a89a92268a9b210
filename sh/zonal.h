#pragma once

// Convolution with kernels that are symmetric about an axis. A kernel K(w.n) acts on band l by one factor,
//   (K * f)_lm = A_l f_lm,   A_l = 2 pi integral_{-1..1} K(t) P_l(t) dt        (Funk-Hecke),
// with (K * f)(n) = integral of K(w.n) f(w) dw.

#include <span>
#include <vector>

#include "sh/error.h"

namespace daylit::sh {

/// A_0 .. A_degree of max(0, t)^exponent, exponent >= 1 real:
///   A_0 = 2 pi / (s + 1), A_1 = 2 pi / (s + 2), A_l = A_{l-2} (s + 2 - l) / (s + l + 1)
/// (MacRobert; Ramamoorthi & Hanrahan 2002, eq. 25, as a recurrence). Each factor has one rounding, so the relative
/// error is at most 2 l epsilon for every s and l: no cancellation. Exponent 1 is the clamped cosine.
Expected<std::vector<double>> phong_bands(double exponent, int degree);

/// The same divided by A_0: the kernel integrates to 1, so the result is a weighted mean of the input.
Expected<std::vector<double>> phong_mean_bands(double exponent, int degree);

/// phong_bands(1): A = pi, 2 pi / 3, pi / 4, 0, -pi / 24, ... (Ramamoorthi & Hanrahan 2001, eq. 8).
Expected<std::vector<double>> clamped_cosine_bands(int degree);

/// Smallest degree whose Phong factors |A_l / A_0| stay below `tolerance` from there on; close to
/// sqrt(2 s ln(1 / tolerance)) for large s. In front of an input with flat bands this is the degree to keep.
Expected<int> phong_degree(double exponent, double tolerance);

/// Multiplies band l of every channel by bands[l], in place.
Expected<void> convolve(std::span<const double> bands, int channels, std::span<double> coefficients);

} // namespace daylit::sh
