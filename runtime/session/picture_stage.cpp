#include "runtime/session/picture_stage.h"

#include <optional>
#include <span>
#include <utility>

#include "runtime/composite/camera_match.h"
#include "runtime/indirect/vertex_light.h"
#include "runtime/session/stage_clock.h"

namespace daylit {

namespace {

LightSet without_sun(LightSet lights) {
  lights.sun.clear();
  return lights;
}

void hide_parts(const ShownParts& shown, std::span<VertexLight> light) {
  for (VertexLight& v : light) {
    if (!shown.direct)
      v.open_sky_front = v.open_sky_back = Rgb(0.0f);
    if (!shown.indirect)
      v.indirect_front = v.indirect_back = Rgb(0.0f);
  }
}

} // namespace

Result<void> PictureStage::start_renderer(Backend backend, const RenderSettings& settings,
                                          std::vector<std::string>& notes) {
  renderer_.set(nullptr); // its memory first
  auto made = choose_renderer(backend, room_.volume.room, room_.volume.apertures, notes, settings);
  if (!made)
    return made.error();
  renderer_.set(std::move(*made));
  return {};
}

Result<void> PictureStage::give(const Versioned<RenderCamera>& camera, const Versioned<VirtualObjects>& objects) {
  PictureRenderer& renderer = **renderer_;
  if (const auto given = given_objects_.try_update({renderer_.version(), objects.version()},
                                                   [&](auto&) { return renderer.set_objects(objects->surface); });
      !given)
    return given;
  return given_camera_.try_update({renderer_.version(), camera.version()},
                                  [&](auto&) { return renderer.set_camera(*camera); });
}

Result<void> PictureStage::light_objects(const PictureInputs& in, std::size_t& lit) {
  PictureRenderer& renderer = **renderer_;
  const LightSet& lights = in.light.direct().lights;
  if (const auto r = renderer.set_lights(in.shown->direct ? lights : without_sun(lights)); !r)
    return r;
  const auto in_view = renderer.vertices_in_view();
  if (!in_view)
    return in_view.error();
  lit = 0;
  std::vector<VertexLight> light =
      light_vertices(in.objects->surface, in.objects->has_back, *in_view, in.light.indirect().radiance, in.sky->pyramid,
                     in.light.direct().cells, lit);
  hide_parts(*in.shown, light);
  return renderer.set_vertex_light(light);
}

/// What the objects do to the room's indirect light, in the camera's view.
void PictureStage::change_room(const PictureInputs& in) {
  view_.update({renderer_.version(), in.camera.version()},
               [&](ViewCorners& view) { view = ViewCorners(*in.camera, room_.rays, renderer_->get()); });
  change_.update({drawn_.version()},
                 [&](ChangePicture& change) { change.update(*view_, *room_.indirect_shadow, &*drawn_); });
}

Result<void> PictureStage::update(const PictureInputs& in, FrameReport& report) {
  StageClock clock(report);
  if (const auto given = give(in.camera, in.objects); !given)
    return given;
  const auto lit = lit_.try_update({given_camera_.version(), in.light.version(), in.shown.version()},
                                   [&](std::size_t& count) { return light_objects(in, count); });
  if (!lit)
    return lit;
  if (!lit_.reused()) {
    clock.end("object_light");
    report.vertices_lit = *lit_;
  }
  const auto drawn =
      drawn_.try_update({lit_.version()}, [&](RenderedFrame& frame) { return (*renderer_)->draw(frame); });
  if (!drawn)
    return drawn;
  if (!drawn_.reused()) {
    clock.end("render");
    report.shadow_rays = (*renderer_)->shadow_rays();
    if (room_.indirect_shadow) {
      change_room(in);
      clock.end("indirect_shadow");
    }
  }
  report.indirect_shadow_left_out = room_.indirect_shadow ? static_cast<double>(change_->left_out()) : 0.0;
  report.reused.object_light = lit_.reused();
  report.reused.drawn = drawn_.reused();
  return {};
}

/// What mirrors and refracts, over the composite of everything else.
GlossyCounts PictureStage::add_glossy(const PhotoPixels& photo, const PictureInputs& in, const PhotoScale& scale,
                                      Composite& result) const {
  const ObjectRays objects(*in.objects);
  const PhotographedRoom photograph(result, *in.camera, in.lens, scale, photo.white());
  const IndirectShadow* shadow = room_.indirect_shadow ? &*room_.indirect_shadow : nullptr;
  const RoomSeen seen{room_.volume.room, room_.rays,    room_.light, shadow,     in.sky->pyramid,
                      in.sky->sun,       room_.windows, objects,     &photograph};
  const GlossyRays rays(seen, in.light.indirect().sent, {});
  const DrawnPicture drawn{*drawn_, *in.camera};
  const GlossyCounts counts =
      any_per_pixel(*in.objects) ? draw_glossy(drawn, rays, seen, scale, result) : GlossyCounts{};
  if (in.shown->differential)
    result.shadow_pixels += room_.mirror.draw(drawn, rays, seen, scale, result);
  return counts;
}

void PictureStage::compose_with(const PhotoPixels& photo, std::uint64_t noise_seed, const PictureInputs& in,
                                const InteriorConfig& interior, Composite& result, FrameReport& report) const {
  ComposeSettings settings{{interior.scale, interior.colour_matrix}, ShadowMode::ratio};
  settings.differential = in.shown->differential;
  const glm::dvec3 eye = in.camera->eye();
  const auto look_up = [&](const glm::dvec3& direction, std::uint32_t triangle) {
    return triangle == kUnknownTriangle ? room_.light.at(eye, direction)
                                        : room_.light.at_plane(triangle, eye, direction);
  };
  compose(photo, *drawn_, *in.camera, look_up, settings, result, room_.indirect_shadow ? &*change_ : nullptr);
  if (in.light.needs_rays(*in.objects)) {
    const GlossyCounts counts = add_glossy(photo, in, settings.photo, result);
    report.glossy_pixels = counts.pixels;
    report.glossy_rays = counts.rays;
  }
  match_blur(photo, interior.blur_px, settings.threshold, result);
  match_noise(photo, interior.noise, noise_seed, result);
}

} // namespace daylit
