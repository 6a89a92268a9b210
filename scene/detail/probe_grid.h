#pragma once

#include "scene/result.h"
#include "scene/volume.h"

namespace daylit::detail {

/// Counts multiply to the number of probes, spacing is positive, probes are where they say (x fastest).
Result<void> check_grid(const ProbeSet& probes);

} // namespace daylit::detail
