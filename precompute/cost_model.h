#pragma once

// How error, time and size follow from the settings of a bake. One table: measured on S1, S3 and the rooms of
// daylit-bench; `daylit-bench error-vs-time` prints prediction and measurement side by side. What depends on the room
// is measured in the room (calibration_bake.h); the model carries it to other settings by powers of their ratios.

#include <string>

#include "precompute/calibration_bake.h"
#include "scene/volume/volume_file.h"

namespace daylit::precompute {

struct CostModel {
  // Errors are nrms of the coefficients at points off the grid, worst of the smooth skies (audit.h).
  double mesh_exponent = 1.2;    ///< mesh error ~ facets^-mesh_exponent
  double mesh_of_halving = 0.85; ///< mesh error at P facets / difference between P/2 and P
  double grid_exponent = 1.9;    ///< grid error without noise ~ spacing^grid_exponent (mean spacing)
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

  // Seconds on the two threads of the machine of the measurement; the calibration bake tells how fast another one is.
  double start_s = 0.05;
  double gather_start_s = 0.05;     ///< of gathering in the calibration bake, whatever its settings
  double exchange_exponent = 1.3;   ///< form factors ~ facets^this ...
  double visibility_exponent = 0.2; ///< ... and visibility rays^this
  double ray_s = 3.5e-8;            ///< per gather ray
  double product_s = 5e-12;         ///< per multiplication of the dense products
  double solve_s = 4.5e-11;         ///< the same of the solver
  // Per element and facet of the calibration bake, which has fewer directions of direct light:
  double bounce_elements = 3.3; ///< first bounce / that of the calibration bake
  double audit_elements = 2.1;  ///< the same of the audit

  // A fine sky: probe clusters, each with factors for all sources.
  double lit_elements = 0.88;            ///< sources / elements wanted
  double rank = 68;                      ///< components of a full cluster at an error of 3 % ...
  double rank_exponent = 0.35;           ///< ... ~ error^-this
  double rank_of_probes = 0.6;           ///< ... ~ probes in the cluster^this
  double rank_of_part = 0.55;            ///< ... ~ BakeWork::compact_part^-this: the probes come no closer with it
  double rank_of_seen = 0.6;             ///< ... ~ what one place sees of the lit area, of a room^this
  double stored_bytes = 0.64;            ///< per coefficient of a factor: most are bytes, packed
  double aggregated_fraction = 0.5;      ///< aggregated sources of a cluster / sources
  double seen_in_room = 0.6;             ///< CalibrationBake::seen_fraction, at least, where all is one room
  double row_padding = 1.02;             ///< rows padded to whole 16 / coefficients of the probes
  double light_bytes = 0.06;             ///< per source and node: what a source sees of the sky
  double compress_s = 2.15e-5;           ///< per source and cluster of `compress_probes`, an error of 3 % ...
  double compress_probes = 128;          ///< probes of that cluster
  double compress_probes_exponent = 1.2; ///< ... ~ probes^this ...
  double compress_exponent = 0.6;        ///< ... ~ error^-this
  double compress_of_seen = 0.35;        ///< ... ~ what one place sees of the lit area, of a room^this
};

inline constexpr CostModel kCostModel{};

/// nrms of the coefficients by the rays of a probe alone.
double ray_noise(double rays_per_probe);
/// A grid error that was measured with noise in it; at least half of it is taken for real.
double without_noise(double error, double rays_per_probe);

/// Mesh error of a bake on so many facets beside those that the faces make by themselves.
double mesh_error(const CalibrationBake& calibration, double facets);
/// Facets of a mesh without elements that is as good as one of so many patches and elements: sqrt(patches elements),
/// scaled so that kPatchFraction and kElementFraction of N facets are worth N.
double equivalent_facets(double patches, double elements);
/// Patches and elements per facet of that mesh: direct light on finer parts than the rest (detail/light_elements.h).
inline constexpr double kPatchFraction = 0.65, kElementFraction = 1.75;
/// Grid error at a mean spacing and so many rays per probe; `at_calibration`: without noise, in the calibration bake.
double grid_error(const CalibrationBake& calibration, double spacing_m, double rays, double at_calibration);

/// What the model knows of a sky.
struct SkyKind {
  double regions = 0;
  bool nodes = false, adaptive = false;

  /// As SkyPartition::parse() and adaptive_regions() read it; a text that was checked.
  static SkyKind of(const std::string& text);
  /// Columns that are solved and kept; `fraction` of the regions is seen by windows, adaptive ones lie where light
  /// comes in.
  double stored(double fraction) const { return adaptive ? regions : regions * fraction; }
};

struct SkyErrors {
  double smooth = 0, sun = 0;
};
/// Sky part of the error; `compact_error`: CompactOptions::error, for nodes.
SkyErrors sky_errors(const SkyKind& sky, double compact_error);

/// What a bake consists of, in counts.
struct BakeWork {
  double facets, probes, columns, channels, gather_rays, elements;
  double seen = 1;         ///< CalibrationBake::seen_fraction
  double compact_part = 1; ///< what the factors of a fine sky may err beside what they may in one room
};
/// Seconds of a whole run, calibration bakes included. `compact_error` 0: no fine sky.
double predicted_seconds(const CalibrationBake& calibration, const BakeWork& work, double visibility_rays,
                         double compact_error);
/// Bytes of the file.
double predicted_bytes(const BakeWork& work, const SkyKind& sky, double compact_error, BasisPrecision precision);

} // namespace daylit::precompute
