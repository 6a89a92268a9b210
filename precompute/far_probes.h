#pragma once

// Planes of probes run through the whole room; what asked for them may be one table. Away from it such probes hold no
// light of their own (scene/volume/interpolated_probes.h).

#include "precompute/standing_faces.h"
#include "scene/room/aperture.h"
#include "scene/room/ray_scene.h"
#include "scene/volume/volume.h"

namespace daylit::precompute {

/// Valid probes of a grid with these planes that one of their three planes is not wanted for become interpolated ones,
/// where the two probes that they would lie between are in the air and see each other.
void interpolate_far_probes(const Planes& planes, const RayScene& scene, const std::vector<Aperture>& apertures,
                            ProbeSet& grid);

/// How many probes of these planes have light of their own, if all were in the air.
std::size_t probes_wanted(const Planes& planes);

} // namespace daylit::precompute
