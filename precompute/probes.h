#pragma once

#include <filesystem>
#include <vector>

#include <glm/vec3.hpp>

#include "precompute/probe_density.h"
#include "precompute/standing_faces.h"
#include "scene/core/result.h"
#include "scene/room/aperture.h"
#include "scene/room/ray_scene.h"
#include "scene/room/room.h"
#include "scene/volume/volume.h"

namespace daylit::precompute {

/// Probes per axis of make_grid() with this spacing, without planes near surfaces.
glm::ivec3 grid_size(const Bounds& room, double spacing_m);
/// With the planes that it has near surfaces.
glm::ivec3 grid_size(const Bounds& room, double spacing_m, const ProbeDensity& density, const Planes& near_surfaces);

/// The planes of make_grid(), those of the density wanted everywhere.
Planes grid_planes(const Bounds& room, const glm::ivec3& count, double spacing_m, const ProbeDensity& density,
                   const Planes& near_surfaces);

/// Error limit_exceeded: more than 4 million.
Result<void> check_probe_count(const glm::ivec3& count);

/// Grid over the room's bounds whose outer probes stand a small margin off the walls.
/// `count` per axis >= 2, or zero on all axes: the spacing decides (metres, at most `spacing_m` apart). Without a
/// density the grid is regular; with one it is graded and has as many probes. `near_surfaces` (planes_near()): planes
/// that it has beside those, which may then be 1.3 times as far apart.
Result<ProbeSet> make_grid(const Bounds& room, const glm::ivec3& count, double spacing_m,
                           const ProbeDensity& density = {}, const Planes& near_surfaces = {});

/// Points inside every aperture, a part of `step_m` to all of it from the pane.
std::vector<glm::dvec3> air_seeds(const std::vector<Aperture>& apertures, double step_m);

/// Marks the probes that stand in the air of the room: those that light can reach from the apertures, found by
/// walking from probe to neighbouring probe along unobstructed segments that cross no aperture. Inside of furniture,
/// behind walls and outdoors stay invalid whatever the orientation of the faces.
void mark_air(ProbeSet& grid, const RayScene& scene, const std::vector<Aperture>& apertures);

/// Free points (world metres): valid when a walk over an auxiliary grid reaches a probe that sees them.
Result<ProbeSet> make_points(const std::vector<glm::dvec3>& world_points, const Bounds& room, const RayScene& scene,
                             const std::vector<Aperture>& apertures);

/// No surface and no aperture between two points of the room.
bool open_between(const glm::dvec3& a, const glm::dvec3& b, const RayScene& scene,
                  const std::vector<Aperture>& apertures);

/// "x y z" per line, '#' starts a comment. Error: file, line, what is wrong.
Result<std::vector<glm::dvec3>> read_points(const std::filesystem::path& path);

} // namespace daylit::precompute
