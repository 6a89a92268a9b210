#pragma once

#include <string>
#include <vector>

#include "scene/config/config.h"
#include "scene/core/result.h"
#include "simulate/trace_scene.h"

namespace daylit {

/// The room, objects, marker board and light of a scene file, to trace. `warnings`: standing_warnings() of the objects,
/// and what reading them and a sky picture had to say.
Result<TraceScene> build_scene(const SimulateConfig& config, std::vector<std::string>* warnings = nullptr);

} // namespace daylit
