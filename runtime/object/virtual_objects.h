#pragma once

#include <string>
#include <vector>

#include "runtime/object/transfer.h"
#include "runtime/render/renderer.h"
#include "scene/config.h"
#include "scene/program.h"
#include "scene/result.h"

namespace daylit {

/// All virtual objects of a scene, placed in the world.
struct VirtualObjects {
  ObjectSurface surface;
  std::vector<VertexTransfer> transfer; ///< per vertex, world frame
  std::vector<std::string> notes;       ///< one line per thing a user should know
  std::size_t transfers_cached = 0, transfers_computed = 0;
};

/// Reads, places and merges the objects; transfer vectors are cached in `cache_folder`.
Result<VirtualObjects> load_virtual_objects(const std::vector<ObjectConfig>& objects,
                                            const std::filesystem::path& cache_folder, const Progress& progress);

} // namespace daylit
