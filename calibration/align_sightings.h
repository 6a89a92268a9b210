#pragma once

// Directions that a camera sees and whose counterparts in the room are known: for daylit-calibrate align alone.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "calibration/command.h"
#include "calibration/orientation_fit.h"
#include "scene/lens/lens.h"

namespace daylit::calibration {

enum class Source { sun, landmarks, board };

struct AlignOptions {
  std::filesystem::path lens, times, landmarks, board;
  std::string place, position;
  double north_deg = 0.0;
  Source source() const {
    return !landmarks.empty() ? Source::landmarks : !board.empty() ? Source::board : Source::sun;
  }
};

/// What the pictures of a board say besides directions.
struct BoardFindings {
  glm::dvec3 position{0.0}; ///< of the camera, world metres
  bool position_given = false, tilt_uncertain = false;
  double sigma_deg = 0.0, sigma_m = 0.0; ///< of a pose from all pictures; 0 where the position is given
};

/// What the pictures say besides the directions that count.
struct Findings {
  std::vector<DroppedPicture> dropped;    ///< pictures and points that gave no direction, with the reason
  std::vector<std::string> suns_at_night; ///< pictures that show a sun where the computed one is below the horizon
  std::optional<BoardFindings> board;     ///< where a board was asked for
};

/// From what the options name. Errors: of the files.
Result<std::vector<Sighting>> sightings_of(const CommonOptions& o, const AlignOptions& options, const LensModel& lens,
                                           Findings& findings);

} // namespace daylit::calibration
