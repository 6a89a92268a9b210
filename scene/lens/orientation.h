#pragma once

// How a camera is held, in words a person uses.

#include <cmath>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

namespace daylit {

/// world_from_camera (columns: right, down, forward, in the world) of a camera that looks towards `azimuth`, counter-
/// clockwise from +x, and `altitude` above the horizon, with the horizon level in its picture; then turned clockwise
/// about its axis, as the photographer sees it, by `roll`. Radians. Straight up and down, the picture's right edge is
/// where it is at smaller altitudes.
inline glm::dmat3 camera_orientation(double azimuth, double altitude, double roll) {
  const glm::dvec3 forward(std::cos(altitude) * std::cos(azimuth), std::cos(altitude) * std::sin(azimuth),
                           std::sin(altitude));
  const glm::dvec3 right(std::sin(azimuth), -std::cos(azimuth), 0.0), down = glm::cross(forward, right);
  return {std::cos(roll) * right + std::sin(roll) * down, std::cos(roll) * down - std::sin(roll) * right, forward};
}

} // namespace daylit
