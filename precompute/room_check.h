#pragma once

// What a bake would find in a room, without baking it: `daylit-precompute check ROOM`.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "precompute/plan.h"
#include "precompute/room_survey.h"
#include "scene/core/program.h"
#include "scene/core/result.h"
#include "scene/room/room_formats.h"

namespace daylit::precompute {

struct CheckedMaterial {
  std::string name;
  Rgb reflectance{0.0f}, transmittance{1.0f};
  float refractive_index = 0.0f; ///< of clear glass, 0: transmittance holds at every angle
  bool is_window = false;
  std::size_t triangles = 0;
  double area_m2 = 0;
};

struct CheckedOpening {
  double area_m2 = 0;
  glm::dvec3 centre_m{0.0}, inward{0.0};
  Rgb transmittance{1.0f};
};

/// What a bake at default settings would take, by the plan that it would follow.
struct BakeEstimate {
  Plan plan;
  BakeReport counts;   ///< of the bake itself, as count_bake()
  std::string cheaper; ///< cheaper_text()
};

struct RoomCheck {
  std::string file;
  RoomReport faces;
  Room room; ///< as it would be baked: gaps closed where that was asked for
  Bounds bounds;
  std::vector<CheckedMaterial> materials;
  std::vector<CheckedOpening> openings;
  RoomSurvey survey;
  std::optional<BakeEstimate> estimate; ///< empty where there is a problem
  std::optional<Error> problem;         ///< why the room cannot be baked
};

/// Everything that a bake does before it computes its volume: survey_room(), openings, calibration bakes, plan, mesh
/// and probes. Error: the file cannot be read as a room, or interrupted. A room that reads but cannot be baked is a
/// RoomCheck with a problem.
Result<RoomCheck> check_room(const std::filesystem::path& path, UpAxis up, double close_gaps_m,
                             const Progress& progress);

std::string to_text(const RoomCheck& check);
std::string to_json(const RoomCheck& check); ///< one object, one line

} // namespace daylit::precompute
