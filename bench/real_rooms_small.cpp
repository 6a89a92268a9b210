#include "bench/real_rooms.h"

namespace daylit::bench {

namespace {

constexpr int kX = 0, kY = 1, kZ = 2; // axes
constexpr double kHeight = 2.5, kInner_m = 0.12, kOuter_m = 0.3;
constexpr double kCorridorLow = 4.12, kCorridorHigh = 5.4;

/// A room of the home: south of the corridor where it ends there, else north.
struct HomeRoom {
  std::string name;
  double x0, x1;
  bool south;
  Rectangle door, window; ///< x, z
};

std::vector<HomeRoom> home_rooms() {
  const auto room = [](const std::string& name, double x0, double x1, bool south, double door, double window,
                       double width) {
    return HomeRoom{name, x0, x1, south, {door, 0, door + 0.85, 2.05}, {window, 0.9, window + width, 2.2}};
  };
  return {room("living room", 0, 5.5, true, 4.2, 1.2, 2.6), room("kitchen", 5.62, 8.6, true, 6.0, 6.4, 1.4),
          room("study", 8.72, 12, true, 9.0, 9.8, 1.2),     room("bedroom", 0, 4.2, false, 3.0, 1.0, 1.8),
          room("bath", 4.32, 6.4, false, 4.6, 5.0, 0.7),    room("child's room", 6.52, 12, false, 7.0, 8.2, 2.0)};
}

Space air_of(const HomeRoom& r) {
  return r.south ? Space{{r.x0, 0, 0}, {r.x1, kCorridorLow - kInner_m, kHeight}}
                 : Space{{r.x0, kCorridorHigh + kInner_m, 0}, {r.x1, 9.2, kHeight}};
}

void add_home_room(ModelWriter& m, const HomeRoom& r) {
  const Space air = air_of(r);
  const Rectangle wall{r.x0, 0, r.x1, kHeight};
  const double at_corridor = r.south ? air.high.y : air.low.y, at_window = r.south ? air.low.y : air.high.y;
  const double outside = at_window + (r.south ? -kOuter_m : kOuter_m);
  m.material("floor");
  m.box(air, 0b000001u);
  m.material("ceiling");
  m.box(air, 0b000010u);
  m.material("white");
  m.box(air, 0b110000u);
  m.panel(kY, at_corridor, wall, {r.door});
  m.reveal(kY, at_corridor, r.south ? kCorridorLow : kCorridorHigh, r.door);
  m.panel(kY, at_window, wall, {r.window});
  m.reveal(kY, at_window, outside, r.window);
  m.material("window");
  m.rectangle(kY, outside, r.window);
}

void furnish_home(ModelWriter& m) {
  m.material("cloth");
  m.solid({{0.6, 2.9, 0}, {2.8, 3.8, 0.45}});   // sofa
  m.solid({{0.8, 7.1, 0}, {2.6, 9.1, 0.5}});    // bed
  m.solid({{10.0, 6.6, 0}, {11.0, 8.6, 0.45}}); // the child's
  m.material("wood");
  m.solid({{3.4, 0.8, 0}, {4.8, 1.7, 0.74}});  // table
  m.solid({{0, 5.6, 0}, {0.6, 6.9, 2.1}});     // wardrobe
  m.solid({{8.0, 0.05, 0}, {8.6, 3.2, 0.9}});  // counter
  m.solid({{9.6, 0.3, 0}, {11.4, 1.0, 0.74}}); // desk
  m.material("white");
  m.solid({{4.4, 8.3, 0}, {6.2, 9.1, 0.55}}); // bath tub
}

/// Under a gabled roof, without a window.
void add_attic(ModelWriter& m) {
  const double z = kHeight + 0.25, top = z + 2.4, middle = 4.6;
  m.material("wood");
  m.rectangle(kZ, z, {0, 0, 12, 9.2});
  for (const double x : {0.0, 12.0})
    m.face({{x, 0, z}, {x, 9.2, z}, {x, middle, top}});
  for (const double y : {0.0, 9.2})
    m.face({{0, y, z}, {12, y, z}, {12, middle, top}, {0, middle, top}});
}

/// Tables in columns and rows.
void add_tables(ModelWriter& m, double x0, double y0, int columns, int rows) {
  m.material("wood");
  for (int i = 0; i < columns; ++i)
    for (int j = 0; j < rows; ++j)
      m.solid({{x0 + 2.1 * i, y0 + 1.5 * j, 0}, {x0 + 2.1 * i + 1.3, y0 + 1.5 * j + 0.6, 0.74}});
}

/// A box room, its wall of low y with openings.
void add_room(ModelWriter& m, const Space& air, const std::vector<Rectangle>& openings) {
  m.material("floor");
  m.box(air, 0b000001u);
  m.material("ceiling");
  m.box(air, 0b000010u);
  m.material("white");
  m.panel(kY, air.low.y, {air.low.x, air.low.z, air.high.x, air.high.z}, openings);
}

} // namespace

RealRoom home() {
  RealRoom room{"home", "seven rooms with doors, a dark attic", {}, {}};
  ModelWriter& m = room.model;
  std::vector<Rectangle> south, north;
  for (const HomeRoom& r : home_rooms()) {
    add_home_room(m, r);
    (r.south ? south : north).push_back(r.door);
    room.places.push_back({r.name, air_of(r), kManyPoints});
  }
  const Space corridor{{0, kCorridorLow, 0}, {12, kCorridorHigh, kHeight}};
  m.material("floor");
  m.box(corridor, 0b000001u);
  m.material("white");
  m.box(corridor, 0b110010u);
  m.panel(kY, corridor.low.y, {0, 0, 12, kHeight}, south);
  m.panel(kY, corridor.high.y, {0, 0, 12, kHeight}, north);
  room.places.push_back({"corridor", corridor, kManyPoints});
  furnish_home(m);
  add_attic(m);
  room.places.push_back({"attic", {{1, 3, kHeight + 0.3}, {11, 6, kHeight + 1.4}}, 6, false});
  return room;
}

RealRoom louvred_classroom() {
  RealRoom room{"louvres", "a classroom with 36 holes behind louvres", {}, {}};
  ModelWriter& m = room.model;
  const Space air{glm::dvec3(0.0), {9, 7, 3.2}};
  std::vector<Rectangle> holes;
  for (int window = 0; window < 4; ++window)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const double x = 0.5 + 2.1 * window + 0.58 * i, z = 0.9 + 0.66 * j;
        holes.push_back({x, z, x + 0.52, z + 0.6});
      }
  add_room(m, air, holes);
  m.box(air, 0b111000u);
  m.material("metal"); // slats that rise towards the room
  for (int i = 0; i < 16; ++i) {
    const double z = 0.8 + 0.14 * i;
    m.face({{-0.2, -0.28, z}, {9.2, -0.28, z}, {9.2, -0.18, z + 0.07}, {-0.2, -0.18, z + 0.07}});
  }
  add_tables(m, 1.0, 1.2, 4, 3);
  room.places.push_back({"classroom", air, kManyPoints});
  return room;
}

RealRoom dim_side_room() {
  RealRoom room{"dim", "a lit room, and one behind a hole of 10 cm", {}, {}};
  ModelWriter& m = room.model;
  const Space lit{glm::dvec3(0.0), {5, 4, 2.8}}, dim{{5.1, 0, 0}, {9.1, 4, 2.8}};
  const Rectangle window{1.2, 0.9, 3.6, 2.3}, hole{2.0, 1.2, 2.1, 1.3};
  add_room(m, lit, {window});
  m.box(lit, 0b011000u);
  m.panel(kX, lit.high.x, {0, 0, 4, 2.8}, {hole});
  m.reveal(kX, lit.high.x, dim.low.x, hole);
  m.panel(kX, dim.low.x, {0, 0, 4, 2.8}, {hole});
  m.box(dim, 0b101100u);
  m.material("floor");
  m.box(dim, 0b000001u);
  m.material("ceiling");
  m.box(dim, 0b000010u);
  m.material("window");
  m.rectangle(kY, 0, window);
  room.places.push_back({"lit room", lit});
  const HoleMouth mouth{{dim.low.x, hole.u0, hole.v0}, {0, hole.u1 - hole.u0, 0}, {0, 0, hole.v1 - hole.v0}, {1, 0, 0}};
  room.places.push_back({"dim room", dim, 24, true, mouth});
  return room;
}

} // namespace daylit::bench
