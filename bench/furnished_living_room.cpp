#include <cmath>
#include <numbers>

#include "bench/chance.h"
#include "bench/real_rooms.h"

namespace daylit::bench {

namespace {

using std::numbers::pi;

constexpr int kY = 1; // axis

/// Turned about z and moved.
struct Placed {
  glm::dvec3 at{0.0};
  double angle = 0;
  glm::dvec3 operator()(const glm::dvec3& p) const {
    const double c = std::cos(angle), s = std::sin(angle);
    return at + glm::dvec3(c * p.x - s * p.y, s * p.x + c * p.y, p.z);
  }
};

double power(double x, double exponent) { return std::copysign(std::pow(std::abs(x), exponent), x); }

/// Superellipsoid (Barr 1981) of half axes `r`: 1 an ellipsoid, towards 0 a box. `bend`: metres that its ends rise
/// along y.
void cushion(ModelWriter& m, const Placed& place, const glm::dvec3& middle, const glm::dvec3& r, double roundness,
             int nu, int nv, double bend = 0.0) {
  m.surface(nu, nv, [&](double u, double v) {
    const double a = 2 * pi * u, b = pi * (v - 0.5);
    const double x = power(std::cos(b), roundness) * power(std::cos(a), roundness);
    const double y = power(std::cos(b), roundness) * power(std::sin(a), roundness);
    return place(middle + glm::dvec3(r.x * x, r.y * y + bend * x * x, r.z * power(std::sin(b), roundness)));
  });
}

/// Surface of revolution about z; `radius` of the height from 0 to 1.
template <class Radius>
void turned(ModelWriter& m, const Placed& place, double low, double high, int nu, int nv, const Radius& radius) {
  m.surface(nu, nv, [&](double u, double v) {
    const double a = 2 * pi * u, r = radius(v);
    return place({r * std::cos(a), r * std::sin(a), low + (high - low) * v});
  });
}

void legs(ModelWriter& m, const Placed& place, double x, double y, double height, double radius, int nu, int nv) {
  for (const double sx : {-x, x})
    for (const double sy : {-y, y})
      turned(m, {place({sx, sy, 0.0}), 0.0}, 0.0, height, nu, nv, [&](double v) { return radius * (0.7 + 0.3 * v); });
}

void chair(ModelWriter& m, const Placed& place) {
  m.material("wood");
  cushion(m, place, {0, 0, 0.45}, {0.22, 0.21, 0.025}, 0.5, 48, 22);
  cushion(m, place, {0, -0.24, 0.75}, {0.21, 0.02, 0.22}, 0.5, 48, 22, 0.06);
  legs(m, place, 0.17, 0.16, 0.44, 0.02, 16, 12);
}

void dining_place(ModelWriter& m) {
  const Placed table{{4.4, 3.2, 0}, 0.1};
  m.material("wood");
  cushion(m, table, {0, 0, 0.73}, {0.95, 0.5, 0.025}, 0.4, 64, 16);
  legs(m, table, 0.7, 0.3, 0.72, 0.04, 24, 10);
  for (int k = 0; k < 3; ++k)
    for (const double side : {-1.0, 1.0})
      chair(m, {table({-0.6 + 0.6 * k, 0.75 * side, 0}), 0.1 + (side > 0 ? pi : 0.0) + 0.05 * k});
  for (const double side : {-1.0, 1.0})
    chair(m, {table({1.25 * side, 0, 0}), side * pi / 2 + 0.1});
  m.material("metal");
  turned(m, {table({0, 0, 0}), 0}, 1.5, 1.9, 64, 48, [](double v) { return 0.05 + 0.2 * std::sqrt(1 - v * v); });
  m.material("white");
  turned(m, {table({0.2, 0.1, 0}), 0}, 0.756, 1.05, 64, 64,
         [](double v) { return 0.04 + 0.045 * std::sin(pi * std::min(v * 1.2, 1.0)); });
}

void sofa(ModelWriter& m) {
  const Placed place{{1.6, 0.75, 0}, 0};
  m.material("cloth");
  for (const double x : {-0.55, 0.55})
    cushion(m, place, {x, 0.05, 0.34}, {0.53, 0.4, 0.12}, 0.35, 48, 32);
  cushion(m, place, {0, -0.42, 0.5}, {1.15, 0.14, 0.36}, 0.35, 48, 32);
  for (const double x : {-1.22, 1.22})
    cushion(m, place, {x, 0, 0.34}, {0.12, 0.46, 0.28}, 0.35, 48, 32);
}

void shelf(ModelWriter& m, Chance& chance) {
  m.material("wood");
  for (const double y : {1.8, 3.9})
    m.box({{0.005, y, 0.005}, {0.3, y + 0.025, 2.2}});
  for (int board = 0; board < 6; ++board)
    m.box({{0.005, 1.827, 0.05 + 0.42 * board}, {0.3, 3.898, 0.075 + 0.42 * board}});
  const char* const colours[] = {"cloth", "white", "leaf", "floor"};
  for (int board = 0; board < 5; ++board)
    for (double y = 1.84; y < 3.82;) {
      const double thick = chance.between(0.015, 0.06), high = chance.between(0.18, 0.36),
                   deep = chance.between(0.13, 0.22);
      m.material(colours[chance.below(4)]);
      m.box({{0.03, y, 0.077 + 0.42 * board}, {0.03 + deep, y + thick, 0.077 + 0.42 * board + high}});
      y += thick + chance.between(0.001, 0.03);
    }
}

void plant(ModelWriter& m, Chance& chance) {
  const Placed place{{5.8, 0.7, 0}, 0};
  m.material("floor");
  turned(m, place, 0.0, 0.35, 32, 8, [](double v) { return 0.13 + 0.05 * v; });
  m.material("leaf");
  for (int i = 0; i < 400; ++i) {
    const double azimuth = chance.between(-pi, pi), rise = chance.between(-0.2, 1.0), reach = chance.between(0.1, 0.25);
    const Placed leaf{place({0.1 * std::cos(azimuth), 0.1 * std::sin(azimuth), chance.between(0.4, 1.3)}), azimuth};
    m.surface(4, 2, [&](double u, double v) {
      const double width = 0.025 * std::sin(pi * (0.05 + 0.9 * u));
      return leaf({reach * u, width * (2 * v - 1), reach * (rise * u - u * u) + 0.01 * std::abs(2 * v - 1)});
    });
  }
}

/// Cloth in waves: a carpet and the curtains beside the windows.
void cloth(ModelWriter& m) {
  m.material("cloth");
  m.surface(64, 40, [](double u, double v) {
    return glm::dvec3(0.7 + 2.4 * u, 1.5 + 1.6 * v, 0.012 + 0.004 * std::sin(25 * u) * std::sin(18 * v));
  });
  m.material("white");
  for (const double x : {0.3, 2.75, 5.1})
    m.surface(60, 30, [x](double u, double v) {
      return glm::dvec3(x + 0.5 * u, 0.12 + 0.04 * std::sin(2 * pi * 5 * u), 0.05 + 2.4 * v);
    });
}

} // namespace

RealRoom furnished_living_room() {
  RealRoom room{"furnished", "a living room of 100,000 triangles", {}, {}};
  ModelWriter& m = room.model;
  const Space air{glm::dvec3(0.0), {6.5, 5, 2.7}};
  const std::vector<Rectangle> windows{{0.9, 0.9, 2.6, 2.3}, {3.4, 0.1, 5.0, 2.3}};
  m.material("floor");
  m.box(air, 0b000001u);
  m.material("ceiling");
  m.box(air, 0b000010u);
  m.material("white");
  m.box(air, 0b111000u);
  m.panel(kY, 0, {0, 0, 6.5, 2.7}, windows);
  m.material("window");
  for (const Rectangle& w : windows)
    m.rectangle(kY, 0, w);
  Chance chance(3);
  dining_place(m);
  sofa(m);
  shelf(m, chance);
  plant(m, chance);
  cloth(m);
  room.places.push_back({"living room", air, 64});
  return room;
}

} // namespace daylit::bench
