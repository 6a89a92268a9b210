#pragma once

// The scenes of the demo, generated from published numbers: a daylit room after the Cornell box (Goral et al. 1984; the
// measured box of Cornell's Program of Computer Graphics) with a window in its red wall, and Newell's teapot in it.

#include <filesystem>
#include <string>

#include "scene/config/config.h"
#include "scene/core/result.h"
#include "scene/model/object_mesh.h"

namespace daylit {

/// Wavefront text of the room: the Cornell box five times as large (2.78 x 2.796 x 2.744 m, z up, red wall at large x,
/// back wall at y = 0), closed at the front, a plain hole of 1.4 x 1.2 m in the red wall. Refers to `mtl_name`.
std::string sample_room_obj(const std::string& mtl_name);
std::string sample_room_mtl();

/// Wavefront text with normals and one material, and that material.
std::string object_obj(const ObjectMesh& mesh, const std::string& mtl_name);
std::string object_mtl(const Rgb& reflectance);

/// "overcast": the teapot on the floor under the CIE overcast sky. "sun": in the sun patch. "shade": the sun patch lies
/// elsewhere. Error: another name.
Result<SimulateConfig> sample_scene(const std::string& name, int width_px, int height_px);

/// Writes room.obj, room.mtl, teapot.obj, teapot.mtl and scene.toml into a folder; returns the path of scene.toml.
/// Error: a file of one of these names is not of this function, and `force` is not set.
Result<std::filesystem::path> write_sample_scene(const std::string& name, const std::filesystem::path& folder,
                                                 int width_px, int height_px, bool force = false);

} // namespace daylit
