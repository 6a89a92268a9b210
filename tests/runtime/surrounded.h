#pragma once

// A room whose light is known everywhere, and an object in its air.

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/indirect/indirect_shadow.h"
#include "runtime/sky/window_sampler.h"
#include "test_session.h"

namespace daylit::test {

constexpr double kPi = std::numbers::pi;

/// The box room under an indirect light that is the same everywhere and in all directions, and that its white walls
/// send back; a sphere in its air.
struct Surrounded {
  BasisVolume volume;
  LightField field;
  LightFieldSampler sampler = *LightFieldSampler::make(volume);
  RayScene rays = *RayScene::build(volume.room);
  RoomLight room_light{volume.room, rays, sampler};
  std::vector<SkyMap> pyramid;
  std::vector<ApertureCell> cells;
  ObjectMesh mesh;
  RayScene mesh_rays;
  IndirectShadow change;

  static constexpr double kRadiance = 2.0;
  static RayScene rays_of(const ObjectMesh& mesh) {
    return *RayScene::build(std::vector<glm::dvec3>(mesh.positions.begin(), mesh.positions.end()), mesh.triangles);
  }
  /// Without windows their place is wall.
  static BasisVolume white_box(bool closed) {
    BasisVolume box = box_volume({});
    for (Material& m : box.room.materials)
      m.reflectance = Rgb(1.0f);
    for (const Aperture& pane : closed ? box_window() : std::vector<Aperture>{}) {
      const auto first = static_cast<std::uint32_t>(box.room.vertices.size());
      box.room.vertices.insert(box.room.vertices.end(), pane.corners.begin(), pane.corners.end());
      for (std::uint32_t k = 2; k < pane.corners.size(); ++k)
        box.room.triangles.push_back({{first, first + k - 1, first + k}, box.room.triangles[0].material});
    }
    return box;
  }
  static BasisVolume furnished(BasisVolume box, const std::function<void(Room&)>& furnish) {
    if (furnish)
      furnish(box.room);
    return box;
  }
  explicit Surrounded(float radius, const std::vector<Aperture>& windows = {}, float sky_factor = 0.0f,
                      const std::function<void(Room&)>& furnish = {})
      : volume(furnished(white_box(windows.empty()), furnish)), mesh(torus(0.0f, radius, 96, 64)),
        mesh_rays(rays_of(mesh)), change(volume.room, rays, windows, room_light) {
    Sh9Rgb light{};
    light[0] = Rgb(static_cast<float>(kRadiance * 2.0 * std::sqrt(kPi)));
    field.probe.assign(volume.probes.size(), light);
    SkyMap sky = overcast_sky(64);
    for (Rgb& c : sky.radiance)
      c *= sky_factor;
    pyramid = sky_map_pyramid(sky);
    cells = aperture_cells(windows, {{2, 3, 1}, 0.2}, pyramid);
    room_light.set_frame(field, pyramid, cells, {});
  }
  void set_walls(float reflectance) {
    for (Material& m : volume.room.materials)
      m.reflectance = Rgb(reflectance);
  }
  /// At a place, sending `radiance` from everywhere, under a sun.
  void place(const glm::dvec3& at, float radiance, const std::optional<DetectedSun>& sun = {}) {
    glm::dmat4 world(1.0);
    world[3] = glm::dvec4(at, 1.0);
    change.set_objects({{&mesh_rays, mesh.triangles, mesh.positions, 0, world}});
    change.set_sky(pyramid, sun);
    const ObjectSurface surface = test::place(mesh, at);
    change.set_direct(std::vector<TwoSided>(mesh.positions.size(), {Rgb(radiance), Rgb(radiance)}), surface,
                      surface.reflectance);
    change.set_indirect(std::vector<TwoSided>(mesh.positions.size()));
    change.exchange_with_room(true);
  }
  /// Mean of the change of irradiance over all faces of the box; at the window there is none.
  double mean_change() const {
    constexpr int kSide = 16;
    const Bounds box = volume.room.bounds();
    double power = 0.0, area = 0.0;
    for (int face = 0; face < 6; ++face) {
      const int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
      const double each = box.size()[u] * box.size()[v] / (kSide * kSide);
      for (int k = 0; k < kSide * kSide; ++k) {
        glm::dvec3 x = box.min, out(0.0);
        x[axis] = face % 2 ? box.max[axis] : box.min[axis];
        x[u] += (k % kSide + 0.5) / kSide * box.size()[u];
        x[v] += (k / kSide + 0.5) / kSide * box.size()[v];
        out[axis] = face % 2 ? 1.0 : -1.0;
        RayHit hit;
        area += each;
        if (rays.closest(rays.to_local(x - 0.1 * out), glm::vec3(out), 0.0f, 1.0f, hit))
          power += each * static_cast<double>(change.at(hit.triangle, x, out).irradiance.g);
      }
    }
    return power / area;
  }
  std::size_t lowest_vertex() const {
    return std::ranges::min_element(mesh.positions, {}, &glm::vec3::z) - mesh.positions.begin();
  }
  std::uint32_t floor_at(const glm::dvec3& x) const {
    RayHit hit;
    EXPECT_TRUE(rays.closest(rays.to_local(x + glm::dvec3(0, 0, 0.5)), glm::vec3(0, 0, -1), 0.0f, 1.0f, hit));
    return hit.triangle;
  }
  IndirectChange at(const glm::dvec3& x) const { return change.at(floor_at(x), x, {0, 0, -1}); }
};

} // namespace daylit::test
