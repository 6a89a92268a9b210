#pragma once

// How error, time and size follow from the settings of a bake. One table: measured on S1, S3 and the rooms of
// daylit-bench, `daylit-bench error-vs-time` sets prediction and measurement side by side. What depends on the room is
// measured in the room (pilot.h); what is here is only how it changes from the pilot's settings to those of the plan.

#include <algorithm>
#include <cmath>

namespace daylit::precompute {

struct PlanLaws {
  // Errors are nrms of the coefficients at points off the grid, worst of the smooth skies (audit.h).
  double mesh_exponent = 1.2;    ///< mesh error ~ facets^-mesh_exponent
  double mesh_of_halving = 0.85; ///< mesh error at P facets / difference between P/2 and P
  double grid_exponent = 1.9;    ///< grid error without noise ~ spacing^grid_exponent (mean spacing, after ProbeFit)
  double region_error = 0.057;   ///< sky error of 64 constant regions; ~ 1 / regions
  double region_sun = 0.55;      ///< the same of a small sun, at most; ~ regions^-region_sun_exponent beyond 256
  double region_sun_exponent = 0.95;
  double adaptive_error = 0.02; ///< the same of adaptive regions
  double adaptive_sun = 0.3;
  double adaptive_sun_exponent = 0.7;
  double node_error = 0.003; ///< sky error of 1,024 nodes without compression; ~ 1 / nodes
  double node_sun = 0.17;    ///< the same of a small sun; ~ nodes^-node_sun_exponent
  double node_sun_exponent = 0.74;
  double compact_sun = 1.05;          ///< a sun's error / CompactOptions::error
  double compact_smooth = 0.19;       ///< sky error / CompactOptions::error
  double gather_noise = 0.0072;       ///< grid error of 1,024 rays per probe ...
  double gather_noise_exponent = 0.9; ///< ... ~ rays^-this
  double half_float = 0.0003;         ///< error of half floats

  // Seconds on the two threads of the machine of the measurement; the pilot tells how fast another one is.
  double start_s = 0.05;
  double gather_start_s = 0.05;     ///< of gathering in the pilot, whatever it asks for
  double exchange_exponent = 1.3;   ///< form factors ~ facets^this ...
  double visibility_exponent = 0.2; ///< ... and visibility rays^this
  double ray_s = 3.5e-8;            ///< per gather ray
  double product_s = 5e-12;         ///< per multiplication of the dense products
  double solve_s = 4.5e-11;         ///< the same of the solver
  double audit_elements = 0.85;     ///< audit / that of the pilot, per element and facet of the pilot

  // A fine sky: probe clusters, each with factors for all sources.
  double lit_elements = 0.88;   ///< sources / elements asked for
  double rank = 80;             ///< components of a full cluster at an error of 3 % ...
  double rank_exponent = 0.35;  ///< ... ~ error^-this
  double rank_of_probes = 0.6;  ///< ... ~ probes in the cluster^this
  double stored_bytes = 1.03;   ///< per number of a factor: most are bytes
  double aggregated_fraction = 0.5;     ///< aggregated sources of a cluster / sources
  double row_padding = 1.02;    ///< numbers in whole 16 / numbers of the probes
  double light_bytes = 0.116;   ///< per source and node: what a source sees of the sky
  double compress_s = 0.068;    ///< per cluster of `compress_probes` probes and few sources at an error of 3 % ...
  double compress_probes = 128; ///< probes of that cluster
  double compress_probes_exponent = 1.2; ///< ... ~ probes^this ...
  double compress_exponent = 0.6;        ///< ... ~ error^-this ...
  double compress_square = 4200;         ///< ... ~ 1 + (sources / this)^2
};

inline constexpr PlanLaws kPlanLaws{};

inline double ray_noise(double rays_per_probe) {
  return kPlanLaws.gather_noise * std::pow(1024 / rays_per_probe, kPlanLaws.gather_noise_exponent);
}
/// A grid error that was measured with noise in it; at least half of it is taken for real.
inline double without_noise(double error, double rays_per_probe) {
  const double noise = ray_noise(rays_per_probe);
  return std::sqrt(std::max(error * error - noise * noise, 0.25 * error * error));
}

} // namespace daylit::precompute
