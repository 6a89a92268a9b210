#pragma once

// What stands in the scene of daylit-bench frame.

#include <filesystem>
#include <string>
#include <vector>

#include "scene/config/config.h"
#include "scene/core/result.h"

namespace daylit::bench {

/// Writes the models of `what` into a folder and says how they stand around the place of the first object of `scene`.
/// One object: "teapot" (4 K triangles), "blob" (15 K, closed, bumpy), "folds" (102 K, 40 folds around); three: "few"
/// (14 K in all) and "many" (2.2 M), two bumpy balls and a teapot; five: "five", balls that mirror (smooth and
/// rough), of glass, with squares, and glowing. A colon and a name of scene/material/library.h: of that instead of a
/// diffuse white. Error usage: there is no such object.
Result<std::vector<ObjectConfig>> write_frame_objects(const std::filesystem::path& folder, const std::string& what,
                                                      const RunConfig& scene);

} // namespace daylit::bench
