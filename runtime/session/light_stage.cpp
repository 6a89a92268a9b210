#include "runtime/session/light_stage.h"

#include <utility>

#include "runtime/session/stage_clock.h"
#include "scene/volume/volume_file.h"

namespace daylit {

namespace {

std::vector<PlacedPart> placed_parts(const VirtualObjects& objects) {
  std::vector<PlacedPart> parts;
  for (const VirtualObjects::Part& part : objects.parts)
    parts.push_back({&part.rays(), part.mesh().triangles, part.mesh().positions, part.first_vertex,
                     part.world_from_object, part.opacity, part.sender});
  return parts;
}

} // namespace

LoadedRoom::LoadedRoom(BasisVolume v, LightFieldSampler s, RayScene r, RoomMirror m, bool with_indirect_shadow)
    : volume(std::move(v)), sampler(std::move(s)), rays(std::move(r)), light(volume.room, rays, sampler),
      windows(volume.apertures), mirror(std::move(m)) {
  if (with_indirect_shadow)
    indirect_shadow.emplace(volume.room, rays, volume.apertures, light);
}

Result<std::unique_ptr<LoadedRoom>> load_room(const RunConfig& config) {
  auto volume = read_volume(config.volume);
  if (!volume)
    return volume.error();
  auto sampler = LightFieldSampler::make(*volume);
  if (!sampler)
    return sampler.error();
  auto rays = RayScene::build(volume->room);
  if (!rays)
    return rays.error();
  auto mirror = RoomMirror::make(volume->room, config.glossy_room);
  if (!mirror)
    return mirror.error();
  return std::make_unique<LoadedRoom>(std::move(*volume), std::move(*sampler), std::move(*rays), std::move(*mirror),
                                      config.indirect_shadow);
}

namespace {
/// Times `factor`, on both sides.
void add_emission(const ObjectSurface& surface, float factor, std::span<TwoSided> radiance) {
  for (std::size_t i = 0; i < surface.emission.size(); ++i) {
    radiance[i].front += factor * surface.emission[i];
    radiance[i].back += factor * surface.emission[i];
  }
}

constexpr int kExchanges = 4; // between objects and room; what comes back a fourth time cannot be seen
} // namespace

/// The objects stand in a room on which they cast shadows, and beside each other: both change the light that they see,
/// and what leaves them changes the room.
void LightStage::add_object_effects(const SkyStage& sky, const VirtualObjects& objects,
                                    std::vector<TwoSided>& radiance) const {
  IndirectShadow& shadow = *room_.indirect_shadow;
  const ObjectSurface& surface = objects.senders.surface;
  const std::vector<DirectionalLight> windows = window_lights(sky->pyramid, direct_->cells, direct_->sphere.centre);
  shadow.set_sky(sky->pyramid, sky->sun, sky.version());
  std::vector<TwoSided> direct =
      direct_radiance(windows, surface.normals, objects.senders.transfer, surface.reflectance);
  add_emission(surface, 1.0f, direct); // it lights the room and other objects as what they reflect does
  shadow.set_direct(std::move(direct), surface);
  const std::vector<TwoSided> from_room = radiance;
  for (int k = 0; k < kExchanges; ++k) {
    shadow.set_indirect(radiance);
    shadow.exchange_with_room();
    if (shadow.objects_see_each_other())
      shadow.exchange();
    radiance = from_room;
    add_feedback(shadow, objects, radiance);
    if (shadow.objects_see_each_other())
      add_exchange(shadow, objects, radiance);
  }
  shadow.set_indirect(radiance);
}

/// What is reflected: emission is looked up where it is seen. Without the exchange with the room the sun's light on the
/// objects is not known at vertices: it is left out.
std::vector<TwoSided> LightStage::sent_light(const SkyStage& sky, const VirtualObjects& objects,
                                             std::span<const TwoSided> indirect) const {
  if (room_.indirect_shadow) {
    const std::span<const TwoSided> all = room_.indirect_shadow->sent();
    std::vector<TwoSided> reflected(all.begin(), all.end());
    add_emission(objects.senders.surface, -1.0f, reflected);
    return reflected;
  }
  const std::vector<DirectionalLight> windows = window_lights(sky->pyramid, direct_->cells, direct_->sphere.centre);
  const ObjectSurface& surface = objects.senders.surface;
  std::vector<TwoSided> sent = direct_radiance(windows, surface.normals, objects.senders.transfer, surface.reflectance);
  for (std::size_t i = 0; i < sent.size(); ++i) {
    sent[i].front += indirect[i].front;
    sent[i].back += indirect[i].back;
  }
  return sent;
}

void LightStage::update(const SkyStage& sky, const Versioned<VirtualObjects>& objects, int samples,
                        FrameReport& report) {
  StageClock clock(report);
  const std::vector<Aperture>& apertures = room_.volume.apertures;
  direct_.update({sky.version(), objects.version(), static_cast<Version>(samples)}, [&](ObjectsDirectLight& direct) {
    direct.sphere = objects->sphere;
    direct.lights = sample_lights(sky->pyramid[0], sky->sun, apertures, direct.sphere, samples);
    direct.cells = aperture_cells(apertures, direct.sphere, sky->pyramid);
    room_.light.set_frame(sky.field(), sky->pyramid, direct.cells, direct.lights, sky.version());
    clock.end("samples");
  });
  probes_.update({objects.version()}, [&](ObjectsProbes& probes) {
    const ObjectSurface& senders = objects->senders.surface;
    probes.vertices = find_vertex_probes(room_.sampler, senders.positions);
    probes.outside = spread_vertex_probes(senders.triangles, probes.vertices);
    if (room_.indirect_shadow)
      room_.indirect_shadow->set_objects(placed_parts(*objects));
    clock.end("probes");
  });
  indirect_.update({direct_.version(), probes_.version()}, [&](ObjectsIndirectLight& indirect) {
    indirect.direct =
        direct_coefficients(sky->pyramid, direct_->cells, direct_->lights.sun, apertures, direct_->sphere.centre);
    indirect.radiance = relight_vertices(sky.field(), probes_->vertices, objects->senders.transfer, indirect.direct,
                                         objects->senders.surface.reflectance, &indirect.ringing);
    if (room_.indirect_shadow)
      add_object_effects(sky, *objects, indirect.radiance);
    indirect.from_room = light_in_boxes(*objects, sky.field(), probes_->vertices,
                                        room_.indirect_shadow ? &*room_.indirect_shadow : nullptr);
    indirect.sent = needs_rays(*objects) ? sent_light(sky, *objects, indirect.radiance) : std::vector<TwoSided>{};
    clock.end("object_light");
  });
  report.reused.samples = direct_.reused();
  report.reused.probes = probes_.reused();
  report.ringing = indirect_->ringing;
}

} // namespace daylit
