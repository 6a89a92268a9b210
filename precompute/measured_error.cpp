#include "precompute/measured_error.h"

#include <algorithm>
#include <cmath>

#include "precompute/cost_model.h"
#include "precompute/probes.h"

namespace daylit::precompute {

namespace {

constexpr double kClearlyFiner = 1.8; ///< ratio of facets from which a difference shows an error

/// Facets of the model that the mesh of the report is worth, with its elements.
double facets_of(const BakeReport& report) {
  const double elements_per_patch =
      static_cast<double>(report.elements) / static_cast<double>(std::max<std::size_t>(report.patches, 1));
  const auto facets = static_cast<double>(report.facets);
  return equivalent_facets(facets, elements_per_patch * facets);
}

/// Richardson: with an error e ~ facets^-a, the difference of two meshes is e (ratio^a - 1), e the finer mesh's error.
/// Against the finest calibration mesh that is clearly coarser; on a mesh no finer than any, the model decides.
double estimated_mesh_error(const CalibrationBake& calibration, const BakeReport& report) {
  const double facets = facets_of(report);
  for (const CalibrationMesh* mesh : {&calibration.fine, &calibration.coarse}) {
    const double ratio = facets / static_cast<double>(std::max<std::size_t>(mesh->facets, 1));
    if (ratio > kClearlyFiner)
      return mesh_difference(mesh->audit, report.audit) / (std::pow(ratio, kCostModel.mesh_exponent) - 1.0);
  }
  return mesh_error(calibration, facets);
}

} // namespace

/// Carries the measured errors back to the settings of the calibration bake by the same powers that predicted them.
CalibrationBake corrected(const CalibrationBake& calibration, const Plan& plan, const BakeReport& report) {
  CalibrationBake better = calibration;
  const double facets = facets_of(report);
  better.mesh_error = estimated_mesh_error(calibration, report) *
                      std::pow(facets / static_cast<double>(calibration.fine.facets), kCostModel.mesh_exponent);
  if (!plan.options.points.empty())
    return better;
  const glm::ivec3 count =
      plan.options.grid.x > 0 ? plan.options.grid : grid_size(calibration.bounds, plan.options.spacing_m);
  const double back =
      std::pow(calibration.spacing_m / mean_spacing(calibration.bounds, count), kCostModel.grid_exponent);
  better.grid_error = back * without_noise(report.audit.smooth(&SkyError::grid_part), plan.options.gather_rays);
  better.grid_sun = back * without_noise(report.audit.sun(&SkyError::grid_part), plan.options.gather_rays);
  return better;
}

/// total^2 = volume^2 + mesh^2: the audit compares with the same mesh, so it cannot see the error of the mesh.
Measured measured_error(const CalibrationBake& calibration, const BakeReport& report) {
  Measured m;
  m.mesh = estimated_mesh_error(calibration, report);
  m.volume = report.audit.smooth(&SkyError::total);
  m.total = std::hypot(m.volume, m.mesh);
  m.irradiance = std::hypot(report.audit.smooth(&SkyError::irradiance), m.mesh);
  const double sun = report.audit.sun(&SkyError::total);
  m.sun = sun > 0 ? std::hypot(sun, m.mesh) : 0.0;
  m.points = report.audit.points.size();
  for (const SkyError& s : report.audit.sky)
    if (!s.is_sun && s.total >= m.volume)
      m.worst_sky = s.sky;
  return m;
}

} // namespace daylit::precompute
