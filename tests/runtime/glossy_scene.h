#pragma once

// A sphere of some material in a room whose light is known, and what a viewer sees of it.

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "runtime/reflect/glossy_rays.h"
#include "surrounded.h"

namespace daylit::test {

inline constexpr auto kRoom = static_cast<float>(Surrounded::kRadiance);

inline ObjectMaterial metal(float roughness) {
  ObjectMaterial m;
  m.base_colour = Rgb(1.0f);
  m.metallic = 1.0f;
  m.roughness = roughness;
  return m;
}

inline ObjectMaterial glass() {
  ObjectMaterial m;
  m.base_colour = Rgb(1.0f);
  m.roughness = 0.0f;
  m.transmission = 1.0f;
  return m;
}

/// A sphere of a material in the middle of the white room.
struct GlossyScene {
  static constexpr float kRadius = 0.15f, kIndirect = 0.5f;
  glm::dvec3 middle{2.0, 2.5, 1.2};
  Surrounded room;
  VirtualObjects objects;
  std::optional<ObjectRays> rays;
  ApertureCrossings windows;
  std::optional<DetectedSun> sun;
  std::optional<RoomSeen> seen;
  std::vector<TwoSided> sent, indirect;
  std::vector<DirectionalLight> lights;
  std::optional<GlossyRays> glossy;
  mutable std::uint64_t followed = 0; ///< rays of the latest look()
  std::size_t place_bits = 6;         ///< a lobe is looked at in two to the power of it places

  explicit GlossyScene(const ObjectMaterial& material, const GlossySettings& settings = {},
                       const std::vector<Aperture>& panes = {}, float sky_factor = 0.0f)
      : room(kRadius, panes, sky_factor), windows(panes) {
    room.mesh.materials = {material};
    glm::dmat4 world(1.0);
    world[3] = glm::dvec4(middle, 1.0);
    objects.surface = test::place(room.mesh, middle);
    objects.surface.reflectance.assign(room.mesh.positions.size(), Rgb(1.0f));
    VirtualObjects::Part part;
    part.model = std::make_shared<const VirtualObjects::Model>(
        VirtualObjects::Model{room.mesh, {}, Surrounded::rays_of(room.mesh)});
    part.world_from_object = world;
    part.per_pixel = true;
    objects.parts.push_back(std::move(part));
    objects.find_bounds(0);
    sent.assign(room.mesh.positions.size(), {Rgb(Surrounded::kRadiance), Rgb(Surrounded::kRadiance)});
    indirect.assign(room.mesh.positions.size(), {Rgb(kIndirect), Rgb(kIndirect)});
    renew(settings);
  }
  /// A sphere more, of that radius.
  void add(const ObjectMaterial& material, const glm::dvec3& at) {
    ObjectMesh mesh = room.mesh;
    mesh.materials = {material};
    const ObjectSurface surface = test::place(mesh, at);
    VirtualObjects::Part part = objects.parts[0];
    part.first_vertex = objects.surface.positions.size();
    part.world_from_object[3] = glm::dvec4(at, 1.0);
    part.model =
        std::make_shared<const VirtualObjects::Model>(VirtualObjects::Model{mesh, {}, Surrounded::rays_of(mesh)});
    objects.surface.positions.insert(objects.surface.positions.end(), surface.positions.begin(),
                                     surface.positions.end());
    objects.surface.reflectance.resize(objects.surface.positions.size(), Rgb(1.0f));
    objects.parts.push_back(std::move(part));
    objects.find_bounds(1);
    sent.resize(objects.surface.positions.size(), sent[0]);
    indirect.resize(objects.surface.positions.size(), indirect[0]);
    renew();
  }
  /// After the objects changed.
  void renew(const GlossySettings& settings = {}) {
    rays.emplace(objects);
    seen.emplace(
        RoomSeen{room.volume.room, room.rays, room.room_light, nullptr, room.pyramid, sun, windows, *rays, nullptr});
    glossy.emplace(*seen, sent, indirect, std::span<const DirectionalLight>{}, settings);
  }
  /// The first object.
  void move_to(const glm::dvec3& place) {
    for (std::size_t v = 0; v < room.mesh.positions.size(); ++v)
      objects.surface.positions[v] += place - middle;
    objects.parts[0].world_from_object[3] = glm::dvec4(place, 1.0);
    objects.find_bounds(0);
    middle = place;
    renew();
  }
  /// Wide lobes find the sky by samples of it, too.
  void look_at_sky_by_lights(const std::vector<Aperture>& panes) {
    lights = sample_lights(room.pyramid[0], std::nullopt, panes, {middle, kRadius}, 64).sky;
    glossy.emplace(*seen, sent, indirect, lights, GlossySettings{});
  }
  /// Radiance towards a viewer who looks past the middle at this distance.
  Rgb radiance(double aside) const {
    const GlossyLight light = look(aside);
    return light.radiance + light.coat + light.diffuse * kRoom - light.occluded;
  }
  /// Every `step`th of the places in the lobe, and a sixteenth of the sky's lights.
  GlossyLight look(double aside, std::size_t first = 0, std::size_t step = 1, int pattern = 0) const {
    const WorldRay ray{middle + glm::dvec3(-1.0, aside, 0.0), glm::vec3(1.0f, 0.0f, 0.0f)};
    const auto point = rays->closest(ray, 10.0);
    std::vector<glm::vec2> places;
    for (std::size_t k = first; k < 1u << place_bits; k += step) { // Hammersley
      std::size_t mirrored = 0;
      for (std::size_t bit = 0; bit < place_bits; ++bit)
        mirrored |= (k >> bit & 1u) << (place_bits - 1 - bit);
      places.push_back((glm::vec2(k, mirrored) + 0.5f) / static_cast<float>(1u << place_bits));
    }
    const CameraPoint camera_point{ray, *point, places, 0.0, pattern};
    GlossyLight light;
    followed = glossy->look({&camera_point, 1}, {&light, 1});
    return light;
  }
  std::uint64_t rays_followed(double aside) const {
    look(aside);
    return followed;
  }
};

} // namespace daylit::test
