#pragma once

// Where a ray meets a thing that only the depth picture knows: pixel by pixel along its way through the picture
// (McGuire & Mara 2014), past tiles of it that show none.

#include <optional>

#include "runtime/depth/real_things.h"
#include "runtime/object/object_rays.h"

namespace daylit {

/// Metres along the ray to the first thing, up to `most_m`; empty: it meets none. A ray that starts inside one leaves
/// it first.
std::optional<double> first_thing(const RealThings& things, const WorldRay& ray, double most_m);

} // namespace daylit
