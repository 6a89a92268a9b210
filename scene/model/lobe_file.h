#pragma once

#include <filesystem>

#include "scene/core/result.h"
#include "scene/model/triangle_soup.h"

namespace daylit::detail {

/// Reads the Lafortune lobes of `MODEL.lobes.toml` beside `MODEL.obj` (.ply, .glb, .gltf), where there is one, into the
/// materials that it names (docs/materials.md). Errors: an unknown key or material, a number out of its range, a
/// picture that is missing or not decoded, a texture on faces without texture coordinates.
Result<void> add_lobes(const std::filesystem::path& model, TriangleSoup& soup);

} // namespace daylit::detail
