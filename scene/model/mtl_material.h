#pragma once

#include <string>

#include "scene/core/result.h"
#include "scene/format/obj_text.h"
#include "scene/material/material.h"

namespace daylit::detail {

/// What an MTL material means here, without its textures; the rules are in docs/materials.md. `fallback`: reflectance
/// where it has neither Kd nor map_Kd. Error value_invalid: a number that its keyword cannot have.
Result<ObjectMaterial> material_from_mtl(const MtlMaterial& mtl, Rgb fallback, const std::string& where);

} // namespace daylit::detail
