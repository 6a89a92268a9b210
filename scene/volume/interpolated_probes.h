#pragma once

// Probes of a grid that hold no light of their own. Planes of probes run through the whole room, but what asks for most
// of them is a table or a sill: elsewhere on such a plane the light is the one between its neighbours.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "scene/core/result.h"
#include "scene/volume/probe_planes.h"
#include "scene/volume/volume.h"

namespace daylit {

/// L(probe) = (1 - weight_b) L(a) + weight_b L(b)
struct InterpolatedProbe {
  std::uint32_t probe = 0, a = 0, b = 0;
  float weight_b = 0;
};

/// The probes of a grid along its axes.
class GridNeighbours {
public:
  /// Keeps a reference to the probes; `interpolated` has one number for each.
  explicit GridNeighbours(const ProbeSet& probes);
  /// A probe along an axis from the nearest two that are not interpolated along it. Nothing where one is missing, or
  /// is neither valid nor interpolated along a later axis.
  std::optional<InterpolatedProbe> between(std::size_t probe, int axis) const;

private:
  bool serves(std::size_t probe, int axis) const;
  const ProbeSet& probes_;
  ProbePlanes planes_;
  std::array<std::size_t, 3> stride_{1, 1, 1};
};

/// Those of ProbeSet::interpolated, in an order in which each comes after those it is interpolated from. One along an
/// axis lies between the nearest two probes along this axis that are not interpolated along it: valid ones, or those
/// interpolated along a later axis. Empty for probes that are no grid. `probes`: check_grid() holds.
/// Error file_malformed: not as many entries as probes, a number above 3, a valid probe, or no neighbour on one side.
Result<std::vector<InterpolatedProbe>> interpolated_probes(const ProbeSet& probes);

/// Fills in the probes of that list, from those before it and from valid ones.
void interpolate_probes(std::span<const InterpolatedProbe> probes, LightField& field);

} // namespace daylit
