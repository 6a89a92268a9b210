#pragma once

// Irradiance in a room into which all light comes through one small hole. Paths that go their own way hardly ever find
// it, so that each is joined with a point of it at every surface that it meets (next event estimation: Veach 1997).

#include <span>
#include <vector>

#include "bench/real_rooms.h"
#include "scene/core/program.h"
#include "scene/core/result.h"
#include "scene/room/room.h"
#include "simulate/irradiance.h"

namespace daylit::bench {

/// As trace_irradiance(), for receivers on the side of the mouth into which its normal points. Same settings, same bits
/// for any number of threads. Errors of the ray scene; interrupted.
Result<std::vector<IrradianceEstimate>> trace_through_hole(const Room& room, const TraceScene& scene,
                                                           const HoleMouth& mouth, std::span<const Receiver> receivers,
                                                           const IrradianceSettings& settings,
                                                           const Progress& progress);

} // namespace daylit::bench
