#pragma once

#include <string>
#include <vector>

#include "scene/core/result.h"
#include "scene/material/material.h"

namespace daylit {

/// Names that [[object]] material may have, sorted.
std::vector<std::string> library_names();

/// A material of the library. Error not_found: no such name; the hint has all of them.
Result<ObjectMaterial> library_material(const std::string& name);

} // namespace daylit
