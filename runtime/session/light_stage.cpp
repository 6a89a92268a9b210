#include "runtime/session/light_stage.h"

#include <utility>

#include "runtime/session/exchange_series.h"
#include "runtime/session/stage_clock.h"
#include "scene/volume/volume_file.h"

namespace daylit {

namespace {

std::vector<PlacedPart> placed_parts(const VirtualObjects& objects) {
  std::vector<PlacedPart> parts;
  for (const VirtualObjects::Part& part : objects.parts)
    parts.push_back({&part.rays(), part.mesh().triangles, part.mesh().positions, part.first_vertex,
                     part.world_from_object, part.has_glass ? &part.mesh() : nullptr, part.transmittance, part.sender,
                     part.is_metal ? std::span<const glm::vec3>(part.mesh().normals) : std::span<const glm::vec3>{}});
  return parts;
}

} // namespace

LoadedRoom::LoadedRoom(BasisVolume v, LightFieldSampler s, RayScene r, RayScene of_light, RoomMirror m,
                       bool with_indirect_shadow)
    : volume(std::move(v)), sampler(std::move(s)), rays(std::move(r)), rays_of_light(std::move(of_light)),
      light(volume.room, rays, sampler), windows(volume.apertures), mirror(std::move(m)) {
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
  auto of_light = rays_of_light(*volume);
  if (!of_light)
    return of_light.error();
  auto mirror = RoomMirror::make(volume->room, config.glossy_room);
  if (!mirror)
    return mirror.error();
  return std::make_unique<LoadedRoom>(std::move(*volume), std::move(*sampler), std::move(*rays), std::move(*of_light),
                                      std::move(*mirror), config.indirect_shadow);
}

namespace {
/// Times `factor`, on both sides.
void add_emission(const ObjectSurface& surface, float factor, std::span<TwoSided> radiance) {
  for (std::size_t i = 0; i < surface.emission.size(); ++i) {
    radiance[i].front += factor * surface.emission[i];
    radiance[i].back += factor * surface.emission[i];
  }
}

constexpr int kExchanges = 4;      // between objects and room, at most
constexpr int kBetweenObjects = 2; // from one object to another: these are further away than the room at the foot
} // namespace

/// The objects stand in a room on which they cast shadows, beside each other, and have parts that face each other: all
/// change the light that they see, and what leaves them changes the room. Without the exchange with the room the sun's
/// light on the objects is not known at vertices: what they reflect of it from part to part is left out.
std::vector<TwoSided> LightStage::exchange_light(const SkyStage& sky, const VirtualObjects& objects,
                                                 std::vector<TwoSided>& radiance, std::vector<Sh9Rgb>& light) const {
  const ObjectSurface& surface = objects.senders.surface;
  const std::vector<DirectionalLight> windows = window_lights(sky->pyramid, direct_->cells, direct_->sphere.centre);
  std::vector<TwoSided> direct = direct_radiance(windows, objects, probes_->windows);
  const bool mirrors = !objects.senders.mirrored_reflectance.empty();
  const std::vector<TwoSided> of_windows = mirrors ? direct : std::vector<TwoSided>{};
  add_emission(surface, 1.0f, direct); // it lights the room and other objects as what they reflect does
  std::vector<TwoSided> from_room = radiance;
  if (!room_.indirect_shadow) {
    reflect_within(objects, direct, from_room, radiance);
    for (std::size_t i = 0; i < direct.size(); ++i) {
      direct[i].front += radiance[i].front;
      direct[i].back += radiance[i].back;
    }
    return direct;
  }
  IndirectShadow& shadow = *room_.indirect_shadow;
  shadow.set_sky(sky->pyramid, sky->sun, sky.version());
  shadow.set_direct(std::move(direct), surface, objects.senders.diffuse_reflectance);
  add_sunlit_correction(shadow, near_sun_, objects, from_room);
  reflect_within(objects, shadow.direct(), from_room, radiance);
  shadow.set_mirrored({}, windows);
  std::vector<std::array<Rgb, 2>> contact;
  ExchangeSeries series(radiance, shadow.direct());
  for (int k = 0; k < kExchanges; ++k) {
    shadow.set_indirect(radiance);
    if (k == 0 && shadow.dims_room())
      dim(objects, light, from_room);
    shadow.exchange_with_room(!near_sun_.is_known()); // what is near sends no light from where their shadow is
    if (k < kBetweenObjects && shadow.objects_see_each_other()) {
      shadow.exchange();
      contact = contact_changes(shadow, objects, probes_->contact);
    }
    std::vector<TwoSided> from_outside = from_room;
    add_feedback(shadow, objects, probes_->feedback, from_outside);
    if (mirrors && k == 0) // what comes back a second time is taken as sent to all sides
      shadow.set_mirrored(mirroring_sides(shadow, objects, light, probes_->windows, of_windows, from_outside), windows);
    if (shadow.objects_see_each_other())
      add_exchange(shadow, objects, probes_->contact, contact, from_outside);
    reflect_within(objects, shadow.direct(), from_outside, radiance);
    if (series.add(radiance))
      break;
  }
  radiance = series.limit();
  shadow.set_indirect(radiance);
  return {shadow.sent().begin(), shadow.sent().end()};
}

/// In the place of the lamps' light before anything was dimmed.
void LightStage::dim(const VirtualObjects& objects, std::vector<Sh9Rgb>& light,
                     std::vector<TwoSided>& from_room) const {
  room_.indirect_shadow->find_dimming();
  std::vector<Sh9Rgb> change = lamp_light(*room_.indirect_shadow, objects);
  for (std::size_t v = 0; v < change.size(); ++v)
    for (std::size_t c = 0; c < 9; ++c) {
      change[v][c] -= probes_->lamps[v][c];
      light[v][c] += change[v][c];
    }
  add_change(objects, change, from_room);
}

std::vector<Sh9Rgb> LightStage::light_of_room(const SkyStage& sky, const VirtualObjects& objects) {
  std::vector<Sh9Rgb> light = light_between(sky.field(), probes_->vertices);
  const std::vector<Sh9Rgb> near = near_sun_.correction(objects, probes_->vertices, probes_.version(), sky->sun,
                                                        room_.indirect_shadow ? &*room_.indirect_shadow : nullptr);
  const auto add = [&](std::span<const Sh9Rgb> more) {
    for (std::size_t v = 0; v < more.size(); ++v)
      for (std::size_t c = 0; c < 9; ++c)
        light[v][c] += more[v][c];
  };
  add(near);
  add(probes_->lamps);
  return light;
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
    if (room_.indirect_shadow) {
      room_.indirect_shadow->set_objects(placed_parts(*objects));
      room_.indirect_shadow->set_lamps(senders);
      probes.feedback = feedback_terms(*room_.indirect_shadow, *objects);
      probes.contact = contact_views(*room_.indirect_shadow, *objects);
      probes.lamps = lamp_light(*room_.indirect_shadow, *objects);
    }
    const IndirectShadow* others = room_.indirect_shadow ? &*room_.indirect_shadow : nullptr;
    probes.windows = window_shares(room_.window_visibility, others, *objects, probes.contact);
    clock.end("probes");
  });
  indirect_.update({direct_.version(), probes_.version()}, [&](ObjectsIndirectLight& indirect) {
    std::vector<Sh9Rgb> light = light_of_room(sky, *objects);
    indirect.radiance =
        relight_vertices(light, objects->senders.transfer, objects->senders.surface.reflectance, &indirect.ringing);
    indirect.sent = exchange_light(sky, *objects, indirect.radiance, light);
    indirect.in_box = light_in_boxes(*objects, light, probes_->vertices, indirect.sent,
                                     room_.indirect_shadow ? &*room_.indirect_shadow : nullptr);
    if (needs_rays(*objects))
      add_emission(objects->senders.surface, -1.0f, indirect.sent); // it is looked up where it is seen
    else
      indirect.sent.clear();
    indirect.arriving = any_normal_map(*objects) ? std::move(light) : std::vector<Sh9Rgb>{};
    clock.end("object_light");
  });
  report.reused.samples = direct_.reused();
  report.reused.probes = probes_.reused();
  report.ringing = indirect_->ringing;
}

} // namespace daylit
