#pragma once

// Indirect irradiance at the points of a generated room by path tracing, kept in a file: bakes of the same room are
// judged by it again and again.

#include <filesystem>
#include <vector>

#include "bench/reference_light.h"
#include "scene/core/program.h"
#include "scene/room/room_formats.h"

namespace daylit::bench {

/// Under one sky, all points of a room, each with the axes +x -x +y -y +z -z.
struct RoomTruth {
  BenchSky sky;
  std::vector<IrradianceEstimate> irradiance;
};

struct TruthSettings {
  int samples = 8192; ///< paths per point and axis
  int suns = 0;       ///< clear skies with the sun somewhere, beside bench_skies()
};

/// Read from `file` where that holds the truth of this room, these points and settings; else traced and written there.
Result<std::vector<RoomTruth>> room_truth(const RoomFile& room, const std::vector<glm::dvec3>& points,
                                          const TruthSettings& settings, const std::filesystem::path& file,
                                          const Progress& progress);

} // namespace daylit::bench
