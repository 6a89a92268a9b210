#pragma once

// Least squares over cameras and markers in a room whose surfaces are flat and at right angles.

#include <array>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>

#include "scene/lens/lens.h"

namespace daylit::calibration::room_markers {

/// A surface: the coordinate that is constant on it, and its axes; u x v looks into the room.
struct Surface {
  const char* name;
  int axis;
  bool is_far; ///< its place is unknown, else 0
  glm::dvec3 u, v;
  glm::dvec3 normal() const { return glm::cross(u, v); }
};

inline const std::array<Surface, 8> kSurfaces = {{{"floor", 2, false, {1, 0, 0}, {0, 1, 0}},
                                                  {"ceiling", 2, true, {1, 0, 0}, {0, -1, 0}},
                                                  {"x0", 0, false, {0, 1, 0}, {0, 0, 1}},
                                                  {"x1", 0, true, {0, -1, 0}, {0, 0, 1}},
                                                  {"y0", 1, false, {-1, 0, 0}, {0, 0, 1}},
                                                  {"y1", 1, true, {1, 0, 0}, {0, 0, 1}},
                                                  {"cut_x", 0, true, {0, -1, 0}, {0, 0, 1}},
                                                  {"cut_y", 1, true, {1, 0, 0}, {0, 0, 1}}}};
inline constexpr std::size_t kPlaces = 8;

/// One marker in one photograph.
struct Sighting {
  std::size_t camera = 0, marker = 0;
  std::array<glm::dvec2, 4> corner_px{};
  std::vector<glm::dmat4> camera_from_marker; ///< one pose, or two that fit nearly alike
};

struct Camera {
  glm::dmat3 turn{1.0}; ///< room_from_camera
  glm::dvec3 position{0.0};
};

struct Marker {
  int id = 0;
  std::size_t surface = 0;
  glm::dvec2 place{0.0}; ///< along the surface's axes, of its middle
  double turn = 0;
};

struct State {
  std::array<double, kPlaces> place{};
  std::vector<Camera> camera;
  std::vector<Marker> marker;
};

glm::dvec3 corner_in_room(const State& state, std::size_t marker, const glm::dvec2& on_marker);

class Fit {
public:
  Fit(const LensModel& lens, double side_m, std::vector<Sighting> sightings);

  /// Levenberg-Marquardt. The variances of the surfaces' places for corners of one pixel's deviation.
  std::array<double, kPlaces> refine(State& state) const;
  /// Seen minus projected, of the four corners.
  std::array<double, 8> residual(const State& state, const Sighting& seen) const;
  const std::vector<Sighting>& sightings() const { return sightings_; }
  const std::array<glm::dvec2, 4>& corners() const { return corner_; } ///< of a marker, metres, from its middle

private:
  double cost(const State& state) const;
  struct Normal;
  Normal normal_equations(const State& state) const;

  LensModel lens_;
  std::array<glm::dvec2, 4> corner_;
  std::vector<Sighting> sightings_;
};

} // namespace daylit::calibration::room_markers
