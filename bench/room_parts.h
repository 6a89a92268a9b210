#pragma once

// Parts of rooms that benches and tests build in memory.

#include <array>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "scene/room/room.h"

namespace daylit::bench {

inline void add_quad(Room& room, glm::dvec3 a, glm::dvec3 b, glm::dvec3 c, glm::dvec3 d, std::uint32_t material = 0) {
  const auto first = static_cast<std::uint32_t>(room.vertices.size());
  room.vertices.insert(room.vertices.end(), {a, b, c, d});
  room.triangles.push_back({{first, first + 1, first + 2}, material});
  room.triangles.push_back({{first, first + 2, first + 3}, material});
}

/// Faces of an axis-aligned box, normals inwards (or outwards: furniture); bit k of `faces` keeps face k:
/// 0 floor, 1 ceiling, 2 south (y low), 3 north, 4 west (x low), 5 east.
inline void add_box(Room& room, glm::dvec3 lo, glm::dvec3 hi, unsigned faces, bool inwards,
                    std::uint32_t material = 0) {
  const auto at = [&](int i) { return glm::dvec3(i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z); };
  constexpr std::array<std::array<int, 4>, 6> corner = {
      {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}}};
  for (unsigned f = 0; f < 6; ++f) {
    if (!(faces >> f & 1u))
      continue;
    const auto& c = corner[f];
    if (inwards)
      add_quad(room, at(c[0]), at(c[1]), at(c[2]), at(c[3]), material);
    else
      add_quad(room, at(c[3]), at(c[2]), at(c[1]), at(c[0]), material);
  }
}

/// Geodesic sphere: every face of an icosahedron cut into n^2.
inline void add_sphere(Room& room, glm::dvec3 centre, double radius, int n) {
  const double g = 0.5 * (1.0 + std::sqrt(5.0));
  const std::array<glm::dvec3, 12> v = {{{-1, g, 0},
                                         {1, g, 0},
                                         {-1, -g, 0},
                                         {1, -g, 0},
                                         {0, -1, g},
                                         {0, 1, g},
                                         {0, -1, -g},
                                         {0, 1, -g},
                                         {g, 0, -1},
                                         {g, 0, 1},
                                         {-g, 0, -1},
                                         {-g, 0, 1}}};
  const std::array<std::array<int, 3>, 20> face = {{{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                                    {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                                    {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                                    {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}}};
  const auto add = [&](glm::dvec3 a, glm::dvec3 b, glm::dvec3 c) {
    const auto first = static_cast<std::uint32_t>(room.vertices.size());
    for (const glm::dvec3& p : {a, b, c})
      room.vertices.push_back(centre + radius * glm::normalize(p));
    room.triangles.push_back({{first, first + 1, first + 2}, 0});
  };
  for (const auto& f : face) {
    const auto at = [&](int i, int j) {
      return v[f[0]] + (v[f[1]] - v[f[0]]) * (double(i) / n) + (v[f[2]] - v[f[0]]) * (double(j) / n);
    };
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j < n; ++j) {
        add(at(i, j), at(i + 1, j), at(i, j + 1));
        if (i + j + 1 < n)
          add(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
      }
  }
}

inline Room grey_room(float reflectance) {
  Room room;
  room.materials.push_back({"grey", Rgb(reflectance), Rgb(1.0f), false});
  return room;
}

/// 4 x 5 x 2.8 m, window hole 1.6 x 1.2 m in the south wall.
inline Room room_with_window_hole(float reflectance) {
  Room room = grey_room(reflectance);
  add_box(room, {0, 0, 0}, {4, 5, 2.8}, 0b111011u, true);
  const std::array<double, 4> x = {0, 1.2, 2.8, 4}, z = {0, 0.9, 2.1, 2.8};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (i != 1 || j != 1)
        add_quad(room, {x[i], 0, z[j]}, {x[i], 0, z[j + 1]}, {x[i + 1], 0, z[j + 1]}, {x[i + 1], 0, z[j]});
  return room;
}

} // namespace daylit::bench
