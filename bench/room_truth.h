#pragma once

// Indirect irradiance at the points of a generated room by path tracing, kept in a file: bakes of the same room are
// judged by it again and again.

#include <filesystem>
#include <optional>
#include <vector>

#include "bench/real_rooms.h"
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

/// Points in one place.
struct TruthPoints {
  std::vector<glm::dvec3> points;
  std::optional<HoleMouth> mouth = {}; ///< trace_through_hole()
};

/// The points of all places one after another. Read from `file` where that holds the truth of this room, these points
/// and settings; else traced and written there (empty: nowhere).
Result<std::vector<RoomTruth>> room_truth(const RoomFile& room, const std::vector<TruthPoints>& places,
                                          const TruthSettings& settings, const std::filesystem::path& file,
                                          const Progress& progress);

} // namespace daylit::bench
