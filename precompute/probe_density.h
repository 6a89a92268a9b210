#pragma once

// Where probes should be close together: where the light is curved, which linear interpolation cuts off.

#include <array>
#include <vector>

#include "scene/core/result.h"
#include "scene/volume/volume.h"

namespace daylit::precompute {

/// Probes per length along each axis up to a factor: positive values at equal steps from the first plane to the last,
/// linear between them. Empty: the same everywhere.
using ProbeDensity = std::array<std::vector<double>, 3>;

inline bool is_graded(const ProbeDensity& density) {
  return !density[0].empty() || !density[1].empty() || !density[2].empty();
}

/// Density from the light of a coarse volume of constant regions on a regular grid. With g the mean squared second
/// difference along an axis over the air of a plane and the regions of the sky, each against its own light (suns, of
/// which any may shine), the error h^2 f'' of linear interpolation is least for h ~ g^-1/5 (equidistribution; de Boor,
/// A Practical Guide to Splines, chapter XII). The exponent here is a third of that: a coarse grid sees the curvature
/// only roughly, and what is wrong costs more than what is not won (README). Error: the volume's room.
Result<ProbeDensity> probe_density(const BasisVolume& coarse);

/// `count` coordinates from `first` to `last` (both among them) with equally much density between neighbours; nowhere
/// further apart than about twice the mean. With `fixed` planes (increasing, between first and last) more: through
/// these, and so that neighbours have at most 1.3 times as much between them.
std::vector<double> planes_of(const std::vector<double>& density, int count, double first, double last,
                              const std::vector<double>& fixed = {});

} // namespace daylit::precompute
