#include "runtime/session/picture_stage.h"

#include <optional>
#include <span>
#include <utility>

#include "runtime/composite/camera_match.h"
#include "runtime/composite/drawn_picture.h"
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

Result<void> PictureStage::start_renderer(Backend backend, const RenderSettings& settings) {
  renderer_.set(nullptr); // its memory first
  auto made = choose_renderer(backend, room_.volume.room, room_.volume.apertures, settings);
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
  lit = in_view->size();
  const std::vector<TwoSided> indirect = reflected_indirect(*in.objects, *in_view, in.light.indirect());
  std::vector<VertexLight> light =
      light_vertices(*in.objects, *in_view, indirect, in.sky->pyramid, in.light.direct().cells);
  hide_parts(*in.shown, light);
  return renderer.set_vertex_light(*in_view, light);
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

/// What of the real room only the depth picture shows; null where it shows nothing.
const ThingLayer* PictureStage::find_things(const PictureToChange& picture, const PictureInputs& in,
                                            const InteriorConfig& interior, const ThingLight& light) {
  if (!picture.depth)
    return nullptr;
  things_.update({picture.version, in.camera.version()}, [&](RealThings& things) {
    things.find(*picture.depth, interior.depth_noise_m, *in.camera, in.lens, room_.rays, renderer_->get());
  });
  if (!things_->any())
    return nullptr;
  const ThingLayerMaker maker(*things_, *in.camera, picture.photo);
  const DrawnPicture drawn{*drawn_, *in.camera};
  maker.make(
      light.objects, [&](int x, int y) { return drawn.photo_pixel(x, y).object.w; }, thing_layer_);
  thing_layer_.light_ratio = [maker, light](int x, int y) {
    const auto point = maker.point(x, y);
    return point ? light.ratio(*point) : Rgb(1.0f);
  };
  return &thing_layer_;
}

/// The maps around the objects, where something changed that they show.
Result<void> PictureStage::update_maps(const PictureToChange& picture, const PictureInputs& in, const RoomSeen& seen,
                                       const GlossyRays& rays, FrameReport& report) {
  StageClock clock(report);
  surroundings_.update({in.sky.version(), in.camera.version(), in.shown.version(), picture.version}, [](auto&) {});
  const auto counts = maps_.update(seen, rays, !surroundings_.reused());
  if (!counts)
    return counts.error();
  report.reflection_maps = counts->maps;
  report.reflection_map_texels = counts->texels;
  clock.end("reflection_maps");
  return {};
}

/// What mirrors and refracts, over the composite of everything else.
Result<void> PictureStage::add_glossy(const PictureToChange& picture, const PictureInputs& in, const PhotoScale& scale,
                                      const ObjectRays& objects, const ThingLayer* things, Composite& result,
                                      FrameReport& report) {
  const PhotographedRoom photograph(result, *in.camera, in.lens, scale, picture.photo.white(), &picture.photo);
  const IndirectShadow* shadow = room_.indirect_shadow ? &*room_.indirect_shadow : nullptr;
  const RoomSeen seen{room_.volume.room,   room_.rays,    room_.light, shadow,      in.sky->pyramid,
                      in.sky->sun,         room_.windows, objects,     &photograph, things ? &*things_ : nullptr,
                      room_.mirror.gloss()};
  const ObjectsIndirectLight& light = in.light.indirect();
  GlossySettings settings{.most_depth = in.shown->reflections};
  if (settings.most_depth < GlossySettings{}.most_depth) // who wants fewer wants no more
    settings.most_more = 0;
  const auto rays_with = [&](const GlossySettings& s) {
    return GlossyRays(seen, light.sent, light.radiance, in.light.direct().lights.sky, s, light.arriving);
  };
  const GlossyRays rays = rays_with(settings);
  const DrawnPicture drawn{*drawn_, *in.camera, things};
  if (any_per_pixel(*in.objects)) {
    if (reflect_by_ == ReflectBy::maps) {
      if (const auto updated = update_maps(picture, in, seen, rays, report); !updated)
        return updated;
      settings.maps = &maps_;
    }
    const GlossyCounts counts = draw_glossy(drawn, rays_with(settings), seen, scale, result);
    report.glossy_pixels = counts.pixels;
    report.glossy_rays = counts.rays;
  }
  if (in.shown->differential)
    result.shadow_pixels += room_.mirror.draw(drawn, rays, seen, picture.photo, scale, result);
  return {};
}

Result<void> PictureStage::compose_with(const PictureToChange& picture, const PictureInputs& in,
                                        const InteriorConfig& interior, Composite& result, FrameReport& report) {
  ComposeSettings settings{{interior.scale, interior.colour_matrix}, ShadowMode::ratio};
  settings.differential = in.shown->differential;
  const glm::dvec3 eye = in.camera->eye();
  const auto look_up = [&](const glm::dvec3& direction, std::uint32_t triangle) {
    return triangle == kUnknownTriangle ? room_.light.at(eye, direction)
                                        : room_.light.at_plane(triangle, eye, direction);
  };
  const ObjectRays objects(*in.objects);
  const ThingLight light{room_.rays,    room_.light, in.light.direct().lights, in.sky->pyramid, in.light.direct().cells,
                         room_.windows, objects};
  const ThingLayer* things = find_things(picture, in, interior, light);
  report.thing_pixels = things ? things_->pixels() : 0;
  compose(picture.photo, *drawn_, *in.camera, look_up, settings, result, room_.indirect_shadow ? &*change_ : nullptr,
          things);
  if (in.light.needs_rays(*in.objects))
    if (const auto added = add_glossy(picture, in, settings.photo, objects, things, result, report); !added)
      return added;
  match_blur(picture.photo, interior.blur_px, settings.threshold, result);
  match_noise(picture.photo, interior.noise, picture.noise_seed, result);
  return {};
}

} // namespace daylit
