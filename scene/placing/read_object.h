#pragma once

#include <string>
#include <vector>

#include "scene/config/config.h"
#include "scene/core/result.h"
#include "scene/model/object_mesh.h"

namespace daylit {

/// The mesh of an [[object]], in its own frame. `material` replaces the materials of the model; `reflectance` becomes
/// its base colour or, alone, makes the object diffuse. `notes`: as read_object_mesh() has them. Errors: those of the
/// model.
Result<ObjectMesh> read_object(const ObjectConfig& object, std::vector<std::string>* notes = nullptr);

} // namespace daylit
