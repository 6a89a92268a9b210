#include "bench/chance.h"
#include "bench/real_rooms.h"

namespace daylit::bench {

namespace {

constexpr int kX = 0, kY = 1, kZ = 2; // axes

/// A classroom's tables, 3 x 3, a desk and a cupboard at the wall of low y.
void furnish_classroom(ModelWriter& m, const Space& room) {
  m.material("wood");
  const double z = room.low.z;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const double x = room.low.x + 2.0 + 2.1 * i, y = room.low.y + 1.5 + 1.7 * j;
      m.solid({{x, y, z}, {x + 1.3, y + 0.55, z + 0.74}});
    }
  m.solid({{room.low.x + 0.6, room.low.y + 2.9, z}, {room.low.x + 1.3, room.low.y + 4.5, z + 0.76}});
  m.solid({{room.low.x + 2.2, room.low.y, z}, {room.low.x + 5.2, room.low.y + 0.45, z + 1.9}});
}

struct SchoolMeasures {
  double low_x = 3.3, pitch = 9.0, width = 8.7;     // of the classrooms
  double corridor_low = 10, corridor_high = 12.8;   // y
  double low_y = 13, high_y = 20, outside_y = 20.3; // classrooms and their facade
  double floor = 0.2, ceiling = 3.4, top = 14, ends = 0.3;
  Rectangle band(int i) const { return {low_x + pitch * i + 0.6, 1.1, low_x + pitch * i + 8.1, 3.0}; }
  Rectangle door(int i) const { return {low_x + pitch * i + 0.5, floor, low_x + pitch * i + 1.5, floor + 2.1}; }
  Space classroom(int i) const {
    return {{low_x + pitch * i, low_y, floor}, {low_x + pitch * i + width, high_y, ceiling}};
  }
};

void add_classroom(ModelWriter& m, const SchoolMeasures& s, int i) {
  const Space room = s.classroom(i);
  m.material("floor");
  m.box(room, 0b000001u);
  m.material("ceiling");
  m.box(room, 0b000010u);
  m.material("white");
  m.box(room, 0b110000u);
  const Rectangle wall{room.low.x, room.low.z, room.high.x, room.high.z};
  m.panel(kY, s.low_y, wall, {s.door(i)});
  m.reveal(kY, s.corridor_high, s.low_y, s.door(i));
  m.panel(kY, s.high_y, wall, {s.band(i)});
  m.reveal(kY, s.high_y, s.outside_y - 0.1, s.band(i));
  m.reveal(kY, s.outside_y - 0.1, s.outside_y, s.band(i));
  m.material("window");
  m.rectangle(kY, s.outside_y - 0.1, s.band(i));
  furnish_classroom(m, room);
}

} // namespace

RealRoom school_wing() {
  const SchoolMeasures s;
  RealRoom room{"school", "six classrooms on a corridor, facades, ground", {}, {}};
  ModelWriter& m = room.model;
  m.material("ground");
  m.rectangle(kZ, 0, {0, 0, 60, 40});
  m.material("facade");
  m.box({{6, 31, 0}, {54, 38, 11}}, 0b111110u); // the wing opposite
  const Space corridor{{s.low_x, s.corridor_low, s.floor}, {s.low_x + 5 * s.pitch + s.width, s.corridor_high, 3.2}};
  const Space outside{{s.low_x - s.ends, s.corridor_low - s.ends, 0}, {corridor.high.x + s.ends, s.outside_y, s.top}};
  const Rectangle end{10.5, 1.0, 12.3, 2.9};
  std::vector<Rectangle> bands, doors;
  for (int i = 0; i < 6; ++i) {
    bands.push_back(s.band(i));
    doors.push_back(s.door(i));
  }
  m.box(outside, 0b100110u);
  m.panel(kX, outside.low.x, {outside.low.y, 0, outside.high.y, s.top}, {end});
  m.panel(kY, s.outside_y, {outside.low.x, 0, outside.high.x, s.top}, bands);
  m.material("floor");
  m.box(corridor, 0b000001u);
  m.material("white");
  m.box(corridor, 0b100110u);
  m.panel(kX, corridor.low.x, {corridor.low.y, corridor.low.z, corridor.high.y, corridor.high.z}, {end});
  m.reveal(kX, corridor.low.x, outside.low.x, end);
  m.panel(kY, s.corridor_high, {corridor.low.x, corridor.low.z, corridor.high.x, corridor.high.z}, doors);
  m.material("window");
  m.rectangle(kX, outside.low.x, end);
  for (int i = 0; i < 6; ++i) {
    add_classroom(m, s, i);
    room.places.push_back({"classroom " + std::to_string(i + 1), s.classroom(i)});
  }
  std::swap(room.places[0], room.places[2]);
  room.places.push_back({"corridor", corridor});
  m.material("wood"); // what is there twice: the cupboards' tops and fronts, pinboards
  for (int i = 0; i < 6; ++i) {
    const Space c = s.classroom(i);
    m.box({{c.low.x + 2.2, c.low.y, c.low.z}, {c.low.x + 5.2, c.low.y + 0.45, c.low.z + 1.9}},
          i < 4 ? 0b011010u : 0b001010u);
  }
  return room;
}

RealRoom hall() {
  RealRoom room{"hall", "40 x 25 x 9 m, 20 windows, 30 boxes", {}, {}};
  ModelWriter& m = room.model;
  const Space air{glm::dvec3(0.0), {40, 25, 9}};
  m.material("floor");
  m.box(air, 0b000001u);
  m.material("ceiling");
  m.box(air, 0b000010u);
  m.material("white");
  m.box(air, 0b110000u);
  std::vector<Rectangle> windows;
  for (int i = 0; i < 10; ++i)
    windows.push_back({1.2 + 3.9 * i, 4, 3.7 + 3.9 * i, 7});
  for (const double y : {0.0, 25.0}) {
    m.material("white");
    m.panel(kY, y, {0, 0, 40, 9}, windows);
    m.material("window");
    for (const Rectangle& w : windows)
      m.rectangle(kY, y, w);
  }
  Chance chance(7);
  for (int i = 0; i < 30; ++i) { // one to a field of 6.6 x 5 m
    m.material(i % 2 == 0 ? "wood" : "metal");
    const double w = chance.between(0.8, 3.5), d = chance.between(0.8, 3.0), h = chance.between(0.5, 3.2);
    const double x = 0.3 + 6.6 * (i % 6) + chance.between(0.0, 2.0), y = 0.2 + 5.0 * (i / 6) + chance.between(0.0, 1.5);
    m.solid({{x, y, 0}, {x + w, y + d, h}});
  }
  room.places.push_back({"hall", air, 64});
  return room;
}

RealRoom atrium() {
  constexpr double kStorey = 3.5, kSlab = 0.3;
  RealRoom room{"atrium", "three storeys around a glass roof", {}, {}};
  ModelWriter& m = room.model;
  const Space air{glm::dvec3(0.0), {18, 14, 3 * kStorey}};
  const Rectangle plan{0, 0, 18, 14}, well{6, 4, 12, 10};
  m.material("floor");
  m.box(air, 0b000001u);
  m.material("white");
  m.box(air, 0b110000u);
  std::vector<Rectangle> south, north, roof;
  for (int storey = 0; storey < 3; ++storey)
    for (int i = 0; i < 4; ++i) {
      const Rectangle w{1.0 + 4.3 * i, kStorey * storey + 1.2, 4.0 + 4.3 * i, kStorey * storey + 2.8};
      south.push_back(w);
      if (i % 2 == 0)
        north.push_back(w);
    }
  for (int i = 0; i < 4; ++i)
    roof.push_back({6.0 + 3.05 * (i % 2), 4.0 + 3.05 * (i / 2), 8.95 + 3.05 * (i % 2), 6.95 + 3.05 * (i / 2)});
  const auto glazed = [&m](int axis, double at, const Rectangle& r, const std::vector<Rectangle>& panes) {
    m.material("white");
    m.panel(axis, at, r, panes);
    m.material("window");
    for (const Rectangle& pane : panes)
      m.rectangle(axis, at, pane);
  };
  glazed(kY, 0, {0, 0, 18, 3 * kStorey}, south);
  glazed(kY, 14, {0, 0, 18, 3 * kStorey}, north);
  glazed(kZ, 3 * kStorey, plan, roof);
  for (int storey = 1; storey < 3; ++storey) {
    const double z = kStorey * storey;
    m.material("floor");
    m.panel(kZ, z, plan, {well});
    m.material("ceiling");
    m.panel(kZ, z - kSlab, plan, {well});
    m.material("white");
    m.reveal(kZ, z - kSlab, z, well);
    m.box({{well.u0, well.v0, z}, {well.u1, well.v1, z + 1.0}}, 0b111100u); // parapet
  }
  m.material("metal");
  for (const double x : {5.7, 12.0})
    for (const double y : {3.7, 10.0})
      for (int storey = 0; storey < 3; ++storey) {
        const double z = kStorey * storey;
        m.box({{x, y, z}, {x + 0.3, y + 0.3, z + kStorey - (storey < 2 ? kSlab : 0.0)}}, 0b111100u);
      }
  m.material("wood");
  for (int storey = 0; storey < 3; ++storey)
    for (int i = 0; i < 5; ++i)
      m.solid({{1.0 + 3.4 * i, 1.2, kStorey * storey}, {2.6 + 3.4 * i, 2.0, kStorey * storey + 0.74}});
  for (int storey = 0; storey < 3; ++storey) {
    const double z = kStorey * storey;
    room.places.push_back({"gallery " + std::to_string(storey + 1), {{0, 0, z}, {18, 3.6, z + kStorey - kSlab}}});
  }
  room.places.push_back({"well", {{6.4, 4.4, 0}, {11.6, 9.6, 3 * kStorey}}});
  return room;
}

} // namespace daylit::bench
