#pragma once

// Rooms as people model them, generated: buildings around the room that is wanted, walls with thickness, furniture of
// many faces. What boxes do not show.

#include <optional>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "bench/model_writer.h"
#include "scene/core/result.h"
#include "scene/room/room.h"

namespace daylit::bench {

/// A parallelogram through which all light of a place comes.
struct HoleMouth {
  glm::dvec3 corner{0.0}, u{0.0}, v{0.0}; ///< world metres, edges from the corner
  glm::dvec3 inward{0.0};                 ///< unit, into the place
};

/// Where light is compared: of 24 points in a room, one or two beside a window decide.
constexpr int kManyPoints = 72;

/// A room of a model in which light is wanted.
struct Place {
  std::string name;
  Space air;       ///< its inside
  int points = 24; ///< where light is compared
  bool lit = true; ///< false: no light can come in
  std::optional<HoleMouth> mouth = {};
};

struct RealRoom {
  std::string name, about;
  ModelWriter model;
  std::vector<Place> places; ///< the first one is what a user asks for
};

/// "school": a wing of six classrooms on a corridor, 60 x 40 x 14 m with ground, facades and the wing opposite, window
/// bands, about 500 polygons of which 16 are there twice. "hall": 40 x 25 x 9 m, 20 windows, 30 boxes. "home": seven
/// rooms with doors, a dark attic. "louvres": a classroom with 36 holes behind louvres. "atrium": three storeys around
/// a glass roof. "furnished": a living room of 100,000 triangles. "dim": a lit room, and one behind a hole of 10 cm.
std::vector<RealRoom> real_rooms();

/// The materials that the models name, as MTL text.
std::string real_rooms_mtl();

/// Points in the air of a place, at random, at least `clearance_m` off all surfaces. Error: too little air.
Result<std::vector<glm::dvec3>> points_in(const RealRoom& room, const Room& geometry, const Place& place,
                                          double clearance_m = 0.1);

RealRoom school_wing();
RealRoom hall();
RealRoom home();
RealRoom louvred_classroom();
RealRoom atrium();
RealRoom furnished_living_room();
RealRoom dim_side_room();

} // namespace daylit::bench
