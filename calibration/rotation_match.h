#pragma once

// What two pictures from one place have in common: directions to the same things, and the turn between the cameras.

#include <array>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "calibration/hand_held_list.h"

namespace daylit::calibration {

/// Directions of the same things in two pictures, each in its own camera's frame, unit length.
struct PictureMatch {
  std::size_t first = 0, second = 0; ///< pictures
  std::vector<std::array<glm::dvec3, 2>> directions;
};

/// SIFT features (Lowe 2004) of pictures whose rough orientations let them overlap, told from chance by one rotation
/// that many of them agree on (Fischler & Bolles 1981) and that differs from the rough one by at most `most_off`
/// radians. Pairs without such a rotation are left out. Error: interrupted.
Result<std::vector<PictureMatch>> match_pictures(std::span<const HandHeldPicture> pictures, double most_off,
                                                 const Progress& progress);

/// The rotation R with least sum |R b - a|^2 (Horn 1987); a = first, b = second of each pair.
glm::dmat3 rotation_between(std::span<const std::array<glm::dvec3, 2>> directions);

} // namespace daylit::calibration
