#pragma once

// Generated rooms baked by the program and compared with path tracing: what issue bars name.

#include <filesystem>
#include <string>
#include <vector>

#include "bench/command.h"
#include "bench/real_rooms.h"
#include "bench/room_truth.h"

namespace daylit::bench {

/// A bake of a room as a user asks for it, and what it may take. Bars of 0 are none; errors are fractions.
struct RoomCase {
  std::string name, room;
  std::string options;      ///< of daylit-precompute; {points} and {inside}: of the first place
  bool first_place = false; ///< light is wanted in the first place only
  double seconds = 0, gigabytes = 0, megabytes = 0;
  double smooth = 0, sun = 0;      ///< in every place that is measured
  std::vector<double> places = {}; ///< other bars of smooth skies, place by place
};

/// "school-points", "school-inside", "school-all", "hall", "home", "louvres", "atrium", "furnished", "dim".
const std::vector<RoomCase>& room_cases();

struct MeasureSettings {
  std::filesystem::path folder; ///< of models, points, truth, volumes and logs
  std::string bake_options;     ///< instead of those of the case
  double limit_s = 1200;
  TruthSettings truth;
};

/// Bakes the case, whose model and points stand in the folder, and compares: one row of the report. A bake that fails
/// is a row that says so. Error: no truth, or interrupted.
Result<nlohmann::json> measure_case(const RoomCase& one, const RealRoom& room, const MeasureSettings& settings,
                                    const Progress& progress);

} // namespace daylit::bench
