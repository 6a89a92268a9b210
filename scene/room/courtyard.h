#pragma once

#include <vector>

#include "scene/room/aperture.h"
#include "scene/room/ray_scene.h"

namespace daylit::detail {

/// Is a hole, through which light comes from above, the sky over a courtyard? It is at least half as large as what it
/// stands over, half way down to the ground, and windows look out there: of what the outer side of some pane sees (by
/// the cosine) a hundredth at least is sky through the hole. Such a hole lights no room, the panes do.
bool is_over_courtyard(const std::vector<Aperture>& hole, const std::vector<Aperture>& windows, const RayScene& scene);

} // namespace daylit::detail
