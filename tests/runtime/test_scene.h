#pragma once

// A small room with one window, objects with and without self-shadow, and an analytic sky: everything the renderer
// needs, in memory.

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "runtime/base/render_camera.h"
#include "runtime/gl/renderer.h"
#include "runtime/sky/direct_light.h"
#include "scene/model/object_mesh.h"
#include "scene/room/room.h"

namespace daylit::test {

inline void add_quad(Room& room, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d,
                     std::uint32_t material) {
  const auto first = static_cast<std::uint32_t>(room.vertices.size());
  room.vertices.insert(room.vertices.end(), {a, b, c, d});
  room.triangles.push_back({{first, first + 1, first + 2}, material});
  room.triangles.push_back({{first, first + 2, first + 3}, material});
}

inline void add_block(Room& room, const glm::dvec3& lo, const glm::dvec3& hi, std::uint32_t material) {
  const auto p = [&](int x, int y, int z) { return glm::dvec3(x ? hi.x : lo.x, y ? hi.y : lo.y, z ? hi.z : lo.z); };
  add_quad(room, p(0, 0, 0), p(1, 0, 0), p(1, 0, 1), p(0, 0, 1), material);
  add_quad(room, p(1, 0, 0), p(1, 1, 0), p(1, 1, 1), p(1, 0, 1), material);
  add_quad(room, p(1, 1, 0), p(0, 1, 0), p(0, 1, 1), p(1, 1, 1), material);
  add_quad(room, p(0, 1, 0), p(0, 0, 0), p(0, 0, 1), p(0, 1, 1), material);
  add_quad(room, p(0, 0, 1), p(1, 0, 1), p(1, 1, 1), p(0, 1, 1), material);
  add_quad(room, p(0, 1, 0), p(1, 1, 0), p(1, 0, 0), p(0, 0, 0), material);
}

/// 4 x 5 x 2.8 m, a window of 1.6 x 1.2 m in the wall at y = 5; material 0 reflects 0.6.
inline Room box_room() {
  Room room;
  room.materials.push_back({"plaster", Rgb(0.6f), Rgb(1.0f), false});
  const double w = 4, l = 5, h = 2.8, x0 = 1.2, x1 = 2.8, z0 = 0.9, z1 = 2.1;
  add_quad(room, {0, 0, 0}, {w, 0, 0}, {w, l, 0}, {0, l, 0}, 0);
  add_quad(room, {0, 0, h}, {0, l, h}, {w, l, h}, {w, 0, h}, 0);
  add_quad(room, {0, 0, 0}, {0, 0, h}, {w, 0, h}, {w, 0, 0}, 0);
  add_quad(room, {0, 0, 0}, {0, l, 0}, {0, l, h}, {0, 0, h}, 0);
  add_quad(room, {w, 0, 0}, {w, 0, h}, {w, l, h}, {w, l, 0}, 0);
  add_quad(room, {0, l, 0}, {w, l, 0}, {w, l, z0}, {0, l, z0}, 0);
  add_quad(room, {0, l, z1}, {w, l, z1}, {w, l, h}, {0, l, h}, 0);
  add_quad(room, {0, l, z0}, {x0, l, z0}, {x0, l, z1}, {0, l, z1}, 0);
  add_quad(room, {x1, l, z0}, {w, l, z0}, {w, l, z1}, {x1, l, z1}, 0);
  return room;
}

inline std::vector<Aperture> box_window(Rgb transmittance = Rgb(1.0f)) {
  return {{{{1.2, 5, 0.9}, {2.8, 5, 0.9}, {2.8, 5, 2.1}, {1.2, 5, 2.1}}, {0, -1, 0}, transmittance}};
}

/// Torus around the z axis; without a hole (major = 0) a sphere.
inline ObjectMesh torus(float major, float minor, int around = 48, int across = 24) {
  ObjectMesh mesh;
  for (int i = 0; i <= around; ++i)
    for (int j = 0; j <= across; ++j) {
      const float pi = std::numbers::pi_v<float>;
      const float u = 2.0f * pi * static_cast<float>(i) / static_cast<float>(around);
      const float v = (major > 0.0f ? 2.0f : 1.0f) * pi * static_cast<float>(j) / static_cast<float>(across) -
                      (major > 0.0f ? 0.0f : 0.5f * pi);
      const glm::vec3 n(std::cos(u) * std::cos(v), std::sin(u) * std::cos(v), std::sin(v));
      mesh.normals.push_back(n);
      mesh.positions.push_back(glm::vec3(major * std::cos(u), major * std::sin(u), 0.0f) + minor * n);
      mesh.reflectance.emplace_back(0.7f, 0.5f, 0.4f);
    }
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(i * (across + 1) + j); };
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

/// A wire that lies on a ring.
inline ObjectMesh ring_with_wire() {
  ObjectMesh mesh = torus(0.15f, 0.07f, 160, 80);
  const ObjectMesh wire = torus(0.15f, 0.012f, 160, 24);
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (std::size_t i = 0; i < wire.positions.size(); ++i) {
    mesh.positions.push_back(wire.positions[i] + glm::vec3(0.02f, 0.0f, 0.08f));
    mesh.normals.push_back(wire.normals[i]);
    mesh.reflectance.push_back(wire.reflectance[i]);
  }
  for (const auto& t : wire.triangles)
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  return mesh;
}

/// Turned about x by `tilt` radians, then moved.
inline ObjectSurface place(const ObjectMesh& mesh, const glm::dvec3& position, double tilt = 0.0) {
  ObjectSurface s;
  s.drawn_reflectance = mesh.reflectance;
  const double c = std::cos(tilt), d = std::sin(tilt);
  const auto turn = [&](const glm::dvec3& p) { return glm::dvec3(p.x, c * p.y - d * p.z, d * p.y + c * p.z); };
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    s.positions.push_back(turn(glm::dvec3(mesh.positions[i])) + position);
    s.normals.emplace_back(turn(glm::dvec3(mesh.normals[i])));
  }
  s.reflectance = mesh.reflectance;
  s.triangles = mesh.triangles;
  return s;
}

/// CIE overcast above the horizon (Moon & Spencer), a fifth of the zenith's radiance below.
inline SkyMap overcast_sky(int height = 256) {
  SkyMap map{2 * height, height, {}};
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x) {
      const double z = map.direction(x + 0.5, y + 0.5).z;
      map.radiance.push_back(Rgb(0.9f, 1.0f, 1.1f) * static_cast<float>(z > 0 ? (1 + 2 * z) / 3 : 0.2));
    }
  return map;
}

/// Looks from `eye` at `target`, world z up.
inline RenderCamera look_at(const glm::dvec3& eye, const glm::dvec3& target, int width, int height, double fov) {
  const glm::dvec3 z = glm::normalize(target - eye), x = glm::normalize(glm::cross(z, glm::dvec3(0, 0, 1))),
                   y = glm::cross(z, x);
  RenderCamera c;
  c.width_px = c.photo_width_px = width;
  c.height_px = c.photo_height_px = height;
  c.fx = c.fy = 0.5 * width / std::tan(0.5 * fov);
  c.cx = 0.5 * (width - 1);
  c.cy = 0.5 * (height - 1);
  c.world_from_camera = glm::dmat4(glm::dvec4(x, 0), glm::dvec4(y, 0), glm::dvec4(z, 0), glm::dvec4(eye, 1));
  return c;
}

inline bool is_finite(const DrawnPixel& p) {
  const glm::vec4 sum = p.object + p.lost_sky + glm::vec4(p.lost_sun, p.received.x + p.received.y);
  return std::isfinite(sum.x) && std::isfinite(sum.y) && std::isfinite(sum.z) && std::isfinite(sum.w);
}

} // namespace daylit::test
