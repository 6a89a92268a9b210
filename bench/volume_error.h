#pragma once

// The indirect light of a baked volume beside path tracing in one place, and beside what the bake claims there.

#include <span>
#include <vector>

#include <nlohmann/json.hpp>

#include "bench/room_truth.h"
#include "scene/room/ray_scene.h"
#include "scene/volume/indirect_light.h"
#include "scene/volume/volume.h"

namespace daylit::bench {

/// The volume's light under the skies of the truth; `scene`, its rays_of_light(), must outlive it. Errors of
/// IndirectLight::make().
Result<std::vector<IndirectLight>> lights_under(const std::vector<RoomTruth>& truth, const BasisVolume& volume,
                                                const RayScene& scene);

/// Of a place, whose points are those of the truth from `first` on. nrms of the irradiance on six axes, relative to the
/// light there, the noise of the reference taken out: `smooth` of the worst smooth sky; `sun`, `sun_looking_in` the
/// 95th percentile of all suns, and of those under which the place has a fifth of the light of the brightest one;
/// `smooth_claimed`, `sun_claimed` what `claimed`, the part "measured" of a bake's report, says of the room there (0:
/// nothing); `noise` of the worst sky; `unknown_points` without light in the volume; `skies` one by one.
nlohmann::json place_error(const std::vector<glm::dvec3>& points, std::size_t first,
                           const std::vector<RoomTruth>& truth, const std::vector<IndirectLight>& lights,
                           const nlohmann::json& claimed);

/// The smallest of the bake's rooms (a room that is no box may hold others) that a point is in: its number in
/// claimed["rooms"], -1 where there is none.
int room_of(const nlohmann::json& claimed, const glm::dvec3& point);

} // namespace daylit::bench
