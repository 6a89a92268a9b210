#pragma once

// A sun patch on the floor of the box room, and objects above it.

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "runtime/indirect/near_sunlight.h"
#include "runtime/object/transfer.h"
#include "sh/sh9.h"
#include "surrounded.h"

namespace daylit::test {

inline const glm::dvec3 kTowardsSun = glm::normalize(glm::dvec3(0.0, 1.0, 0.6));
// Through the window of the box room the sun lights this part of the floor, 1.6 x 2 m.
constexpr double kX0 = 1.2, kX1 = 2.8, kY0 = 1.5, kY1 = 3.5;
inline const std::vector<glm::dvec3> kPlaces{{2.0, 2.5, 0.12}, {2.05, 3.45, 0.13}, {1.2, 2.0, 0.3}};

struct Rectangle {
  float x0, x1, y0, y1;
};
constexpr Rectangle kWider{1.0f, 3.0f, 1.25f, 3.75f}, kLit{1.3f, 2.7f, 1.6f, 3.4f};

/// Names this part of the floor as two elements, whatever sky node the light comes from.
inline BasisVolume with_floor_elements(BasisVolume volume, const Rectangle& r) {
  auto compact = std::make_shared<CompactBasis>();
  compact->light = {1, {1.0f, 1.0f}, {0, 8, 16}, {}, std::vector<std::uint16_t>(128, 0x3c00)};
  for (std::uint16_t k = 0; k < 16; ++k)
    compact->light.block.push_back(k % 8);
  compact->light_unit = {0.08f, 0.05f};
  volume.compact = compact;
  const glm::vec3 a(r.x0, r.y0, 0.0f), b(r.x1, r.y0, 0.0f), c(r.x1, r.y1, 0.0f), d(r.x0, r.y1, 0.0f);
  volume.elements = {{{{a, b, c}}, {{a, c, d}}}, {Rgb(0.5f, 0.4f, 0.3f), Rgb(0.5f, 0.4f, 0.3f)}};
  return volume;
}

/// Spheres of 0.1 m in the box room; every other vertex sends light.
struct SunnyFloor {
  static constexpr float kRadius = 0.1f, kPane = 0.8f, kSun = 3.0f;
  std::vector<Aperture> panes = box_window(Rgb(kPane));
  Surrounded room{kRadius, panes};
  BasisVolume volume;
  ApertureCrossings windows{panes};
  VirtualObjects objects;
  std::vector<VertexProbes> probes;
  std::optional<DetectedSun> sun = DetectedSun{.direction = kTowardsSun, .normal_irradiance = Rgb(kSun)};
  NearSunlight near{volume, room.rays, windows};

  explicit SunnyFloor(const std::vector<glm::dvec3>& places = {kPlaces[0]}, const Rectangle& named = kWider)
      : volume(with_floor_elements(room.volume, named)) {
    stand_at(places);
  }
  static std::shared_ptr<const VirtualObjects::Model> model_of(const ObjectMesh& mesh) {
    VirtualObjects::Model model{mesh, *compute_transfer(mesh), Surrounded::rays_of(mesh)};
    model.senders = find_senders(mesh, {0, 0, 1});
    model.self = *SelfExchange::make(mesh, model.rays, model.senders, false);
    return std::make_shared<const VirtualObjects::Model>(std::move(model));
  }
  void stand_at(const std::vector<glm::dvec3>& places) {
    static const auto sphere = model_of(torus(0.0f, kRadius, 48, 32));
    stand_at(places, sphere, 2, false);
  }
  /// Every `step`th vertex sends light.
  void stand_at(const std::vector<glm::dvec3>& places, const std::shared_ptr<const VirtualObjects::Model>& model,
                std::uint32_t step, bool has_back) {
    const ObjectMesh& mesh = model->mesh;
    objects = {};
    std::vector<PlacedPart> placed;
    for (const glm::dvec3& place : places) {
      VirtualObjects::Part part;
      part.model = model;
      part.first_vertex = objects.surface.positions.size();
      part.world_from_object[3] = glm::dvec4(place, 1.0);
      placed.push_back({&model->rays, mesh.triangles, mesh.positions, part.first_vertex, part.world_from_object});
      for (const glm::vec3& p : mesh.positions)
        objects.surface.positions.push_back(place + glm::dvec3(p));
      objects.parts.push_back(std::move(part));
    }
    objects.has_back.assign(objects.surface.positions.size(), has_back);
    for (std::uint32_t v = 0; v < objects.surface.positions.size(); v += step) {
      objects.senders.vertex.push_back(v);
      objects.senders.surface.positions.push_back(objects.surface.positions[v]);
      objects.senders.surface.normals.push_back(mesh.normals[v % mesh.normals.size()]);
      objects.senders.transfer.push_back(model->transfer[v % mesh.normals.size()]);
    }
    room.change.set_objects(std::move(placed));
    probes = find_vertex_probes(room.sampler, objects.senders.surface.positions);
  }
  const std::vector<glm::dvec3>& at() const { return objects.senders.surface.positions; }
  std::vector<Sh9Rgb> correction(std::uint64_t placement = 1, bool shadow = false) {
    return near.correction(objects, probes, placement, sun, shadow ? &room.change : nullptr);
  }

  /// Radiance of the floor's elements as the volume has it.
  std::vector<Rgb> stored() const {
    std::vector<Rgb> node(64, Rgb(0.0f));
    for (const RegionWeight& w : volume.partition.interpolation(sun->direction))
      node[static_cast<std::size_t>(w.region)] +=
          static_cast<float>(w.weight / volume.partition.solid_angle_sr(w.region)) * sun->normal_irradiance;
    return FirstReflection::make(volume, room.rays)->radiance(node);
  }
  /// Nothing but the floor's first reflection, as the volume has it at its probes.
  std::vector<Sh9Rgb> base() const {
    const auto surfaces = FirstReflection::make(volume, room.rays);
    const std::vector<Rgb> light = stored();
    const auto all = surfaces->near(kPlaces[0], 100.0, light);
    LightField field;
    field.probe.assign(volume.probes.size(), {});
    for (const VertexProbes& p : probes)
      for (int k = 0; k < p.count; ++k)
        field.probe[p.probe[k]] = surfaces->at_probe(p.probe[k], all, light).nine;
    return light_between(field, probes);
  }
  /// L = rho / pi cos T E
  static Rgb patch_radiance() { return static_cast<float>(kTowardsSun.z / kPi) * kPane * kSun * Rgb(0.5f, 0.4f, 0.3f); }
  /// The slow twin, where the sun lights all that the volume names.
  Sh9Rgb correction_at(std::size_t v) const {
    const auto count = static_cast<std::size_t>(probes[v].count);
    return FirstReflection::make(volume, room.rays)
        ->correction(at()[v], std::span(probes[v].probe).first(count), std::span(probes[v].weight).first(count),
                     stored(), [](std::size_t, const FirstReflection::Triangle&) { return patch_radiance(); })
        .nine;
  }
};

inline std::vector<Sh9Rgb> sum(std::vector<Sh9Rgb> a, const std::vector<Sh9Rgb>& b) {
  for (std::size_t v = 0; v < a.size(); ++v)
    for (std::size_t i = 0; i < 9; ++i)
      a[v][i] += b[v][i];
  return a;
}

} // namespace daylit::test
