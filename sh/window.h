#pragma once

// Windows against ringing: one factor per band. A truncated series of a bright small source swings below zero beside
// and opposite to it; a window trades that for blur. What it costs is part of every result.

#include <span>
#include <vector>

#include "sh/error.h"

namespace daylit::sh {

/// w_l = (1 + cos(pi l / cutoff)) / 2 for l < cutoff, else 0. cutoff > 0; degree + 1 keeps some of every band.
Expected<std::vector<double>> hann_window(int degree, double cutoff);

/// w_l = sin(x) / x, x = pi l / cutoff, for l < cutoff, else 0.
Expected<std::vector<double>> lanczos_window(int degree, double cutoff);

/// What a window does to one function. Exact, by Parseval.
struct WindowBias {
  double energy_kept = 1.0; ///< integral of f_w^2 / integral of f^2
  double rms_change = 0.0;  ///< sqrt(mean over the sphere of (f_w - f)^2)
  double max_change = 0.0;  ///< bound on |f_w - f|: sum over bands of (1 - w_l) sqrt((2l + 1) / 4 pi) |f_l|
};
Expected<WindowBias> window_bias(std::span<const double> window, std::span<const double> coefficients);

/// Smallest value on the sphere of a series with (degree + 1)^2 coefficients. Exact (secular equation) up to degree 2;
/// above, the lowest points of a grid of four samples per wavelength, refined to 1e-9 of the range. Degree <= 64.
struct Extremum {
  double value;
  double direction[3];
};
Expected<Extremum> minimum_on_sphere(std::span<const double> coefficients);

/// Largest degree of minimum_on_sphere and nonnegative_window.
inline constexpr int kMaxWindowDegree = 64;

struct NonNegativeWindow {
  std::vector<double> bands;
  double strength = 0.0; ///< lambda of w_l = 1 / (1 + lambda l^2 (l + 1)^2); 0: nothing had to be done
  double minimum_before = 0.0;
  double minimum_after = 0.0; ///< >= 0 up to 1e-12 of the mean
  WindowBias bias;
};

/// The smallest window of the family that minimises the squared Laplacian (Sloan 2008, "Stupid spherical harmonics
/// tricks") for which the series is nowhere negative. The mean, band 0, is kept exactly and must not be negative.
Expected<NonNegativeWindow> nonnegative_window(std::span<const double> coefficients);

} // namespace daylit::sh
