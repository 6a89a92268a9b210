#include "precompute/cost_model.h"

#include <algorithm>
#include <cmath>

#include "precompute/adaptive_sky.h"

namespace daylit::precompute {

namespace {

constexpr const CostModel& model = kCostModel;
constexpr double kFullCluster = static_cast<double>(kProbesInCluster);

/// Sum over the stages of this name, seconds.
double seconds_of(const std::vector<StageTime>& stages, const std::string& name) {
  double sum = 0;
  for (const StageTime& s : stages)
    sum += s.name == name ? s.seconds : 0.0;
  return sum;
}

// Multiplications of the dense products (weights times radiosity), and of the solver: one product with the matrix for
// each column, and a third of a cube for its factor.
double product(const BakeWork& w) { return 9 * w.probes * w.facets * w.columns * w.channels; }
double solve(const BakeWork& w) {
  return w.facets * w.facets * w.columns * w.channels + w.facets * w.facets * w.facets * w.channels / 3;
}
/// Elements that the sky lights.
double sources(const BakeWork& w) { return model.lit_elements * w.elements; }

double probe_clusters(const BakeWork& w) { return std::max(std::ceil(w.probes / kFullCluster), 1.0); }

/// Of the lit surfaces of a room, what one place sees: 1 where all is one room.
double seen_of_room(const BakeWork& w) { return std::min(1.0, w.seen / model.seen_in_room); }

/// In sources times clusters of `compress_probes` probes: sources clusters (probes / p)^a (3 % / error)^b seen^c.
double compression(const BakeWork& w, double error) {
  return probe_clusters(w) * sources(w) *
         std::pow(w.probes / probe_clusters(w) / model.compress_probes, model.compress_probes_exponent) *
         std::pow(0.03 / error, model.compress_exponent) * std::pow(seen_of_room(w), model.compress_of_seen);
}

} // namespace

/// Monte Carlo on a lattice: c (1024 / N)^0.9, a little slower than the 1 / N of a smooth integrand.
double ray_noise(double rays_per_probe) {
  return model.gather_noise * std::pow(1024 / rays_per_probe, model.gather_noise_exponent);
}

/// sqrt(e^2 - noise^2): both are independent.
double without_noise(double error, double rays_per_probe) {
  const double noise = ray_noise(rays_per_probe);
  return std::sqrt(std::max(error * error - noise * noise, 0.25 * error * error));
}

/// e(N) = e_0 (N_0 / N)^a: e_0 measured on N_0 facets in the room, a from the table.
double mesh_error(const CalibrationBake& calibration, double facets) {
  return calibration.mesh_error * std::pow(calibration.free_facets() / facets, model.mesh_exponent);
}

/// Patches decide the exchange, elements the direct light; either alone would be worth its own count.
double equivalent_facets(double patches, double elements) {
  return elements > patches ? std::sqrt(patches * elements / (kPatchFraction * kElementFraction)) : patches;
}

/// Curvature between the probes and noise of their rays are independent: the root of the sum of their squares.
double grid_error(const CalibrationBake& calibration, double spacing_m, double rays, double at_calibration) {
  return std::hypot(at_calibration * std::pow(spacing_m / calibration.spacing_m, model.grid_exponent), ray_noise(rays));
}

SkyKind SkyKind::of(const std::string& text) {
  if (const auto n = adaptive_regions(text))
    return {static_cast<double>(*n), false, true};
  const SkyPartition partition = *SkyPartition::parse(text);
  return {static_cast<double>(partition.size()), partition.interpolated(), false};
}

/// Smooth skies: ~ 1 / N, second order in the width of a region; a sun errs until regions are about its size.
SkyErrors sky_errors(const SkyKind& sky, double compact_error) {
  const double n = sky.regions;
  if (sky.adaptive)
    return {model.adaptive_error * 64 / n, model.adaptive_sun * std::pow(256 / n, model.adaptive_sun_exponent)};
  if (!sky.nodes)
    return {model.region_error * 64 / n,
            model.region_sun * std::pow(256 / std::max(n, 256.0), model.region_sun_exponent)};
  return {std::hypot(model.node_error * 1024 / n, model.compact_smooth * compact_error),
          std::hypot(model.node_sun * std::pow(1024 / n, model.node_sun_exponent), model.compact_sun * compact_error)};
}

/// The calibration bake's own stages, scaled by what each grows with, and what is modelled in operations. Rays and
/// products of probes are scaled by how fast the rays of the calibration bake ran, which says nothing of solver and
/// compression: they meet no surface.
double predicted_seconds(const CalibrationBake& calibration, const BakeWork& work, double visibility_rays,
                         double compact_error) {
  const bool fine = compact_error > 0;
  const auto own_facets = static_cast<double>(calibration.fine.facets);
  const BakeWork own{own_facets,
                     static_cast<double>(calibration.probes),
                     64 * calibration.stored_fraction,
                     static_cast<double>(calibration.channels),
                     calibration.gather_rays,
                     own_facets};
  const auto measured = [&](const char* stage) { return seconds_of(calibration.stages, stage); };
  const double more = work.facets / own.facets, elements = fine ? work.elements / own.facets : more;
  const double modelled = model.gather_start_s + model.ray_s * own.probes * own.gather_rays;
  const double speed = std::clamp(measured("rays") / modelled, 0.1, 10.0);
  double s = calibration.seconds + model.start_s + more * measured("mesh") +
             model.bounce_elements * elements * measured("first bounce");
  s += std::max(model.audit_elements * elements, 1.0) * measured("audit");
  s += measured("form factors") * std::pow(more, model.exchange_exponent) *
       std::pow(visibility_rays / calibration.visibility_rays, model.visibility_exponent);
  s += speed * model.ray_s * work.probes * work.gather_rays + model.solve_s * solve(work);
  return s + (fine ? model.compress_s * compression(work, compact_error) : speed * model.product_s * product(work));
}

/// Regions: 27 values per probe and column. Nodes: per cluster rank x (aggregated sources that it sees + 27 probes),
/// and what every source sees of the sky.
double predicted_bytes(const BakeWork& work, const SkyKind& sky, double compact_error, BasisPrecision precision) {
  if (!sky.nodes)
    return work.probes * 27 * work.columns * (precision == BasisPrecision::float16 ? 2 : 4);
  const double probes = work.probes / probe_clusters(work), seen = seen_of_room(work);
  const double rank = model.rank * std::pow(0.03 / compact_error, model.rank_exponent) *
                      std::pow(probes / kFullCluster, model.rank_of_probes) * std::pow(seen, model.rank_of_seen) *
                      std::pow(work.compact_part, -model.rank_of_part);
  return model.stored_bytes * probe_clusters(work) * rank *
             (model.aggregated_fraction * seen * sources(work) + model.row_padding * 27 * probes) +
         model.light_bytes * sources(work) * sky.regions;
}

} // namespace daylit::precompute
