#pragma once

#include <string>
#include <vector>

#include "scene/model/object_mesh.h"

namespace daylit {

/// Whether light finds an inside behind the faces of solid glass: a line for each material of glass, not thin, whose
/// faces have a hole, or are closed and have their normals inside. `name`: of the object. The winding says what is
/// outside.
std::vector<std::string> glass_notes(const ObjectMesh& mesh, const std::string& name);

} // namespace daylit
