#pragma once

// One augmented camera: everything that is loaded once, and the work of one frame.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "runtime/base/photo_pixels.h"
#include "runtime/composite/compose.h"
#include "runtime/object/relight.h"
#include "runtime/object/virtual_objects.h"
#include "runtime/session/choose_renderer.h"
#include "runtime/sky/direct_light.h"
#include "scene/config/config.h"
#include "scene/core/program.h"
#include "scene/core/result.h"
#include "scene/sky/sky_image.h"

namespace daylit {

/// What a frame took over from the one before, because nothing that it depends on changed.
struct Reused {
  bool sky = false;     ///< sky map, sun, region radiances, light field
  bool samples = false; ///< lights and window cells
  bool probes = false;  ///< which probes light the objects' vertices
  bool object_light = false;
  bool drawn = false;   ///< the objects' picture and their shadows
  bool picture = false; ///< everything: the composite of the frame before is the answer
};

/// Wall-clock milliseconds of the stages of a frame, in order, and what was skipped.
struct FrameReport {
  std::vector<std::pair<std::string, double>> stage_ms;
  double total_ms = 0.0;
  Reused reused;
  std::size_t sky_lights = 0, sun_lights = 0;
  std::size_t object_pixels = 0, shadow_pixels = 0;
  std::size_t thing_pixels = 0; ///< that show what only the depth picture knows
  std::size_t vertices_lit = 0, vertices = 0;
  std::uint64_t shadow_rays = 0;
  std::uint64_t glossy_pixels = 0, glossy_rays = 0; ///< pixels whose material is looked up, rays that left them
  std::size_t reflection_maps = 0;                  ///< around objects, made or renewed
  std::uint64_t reflection_map_texels = 0;          ///< traced for them
  Ringing ringing;                                  ///< of the indirect light on the objects
  double indirect_shadow_left_out = 0.0; ///< largest relative change of the room that was too small to be drawn
  std::vector<std::string> skipped;
  std::vector<std::string> warnings; ///< where the user must act, each with what to do
};

struct Frame {
  Composite composite;
  FrameReport report;
};

/// Pictures of one moment. Equal non-zero ids mean the same picture (a camera's frame counter): it is not looked at
/// again. With 0 the pixels are compared with those of the frame before.
struct FrameInput {
  const SkyImage& sky;
  PhotoPixels photo;
  std::uint64_t sky_id = 0, photo_id = 0;
  /// Of the photograph; null: none. Another one has another address, or comes with another photo_id.
  const DepthPicture* depth = nullptr;
};

/// Parts of the light that are drawn (figure 1 of the paper): to look at them one by one.
struct ShownParts {
  bool direct = true;       ///< on the objects, from sky and sun through the windows
  bool indirect = true;     ///< on the objects
  bool differential = true; ///< on the room: shadows and reflections of the objects
  int reflections = 8;      ///< GlossySettings::most_depth
  bool operator==(const ShownParts&) const = default;
};

class Session {
public:
  /// Loads volume, objects and lens, and starts the renderer. `photo_width_px` x `photo_height_px`: of the pictures
  /// that render() will be given. Errors: any file, no pose, no renderer.
  static Result<Session> open(const RunConfig& config, int photo_width_px, int photo_height_px,
                              const Progress& progress, Backend backend = Backend::rays,
                              const RenderSettings& settings = {});
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;
  ~Session();

  /// Camera x right, y down, z forward. Error: no rigid motion.
  Result<void> set_pose(const glm::dmat4& world_from_camera);
  /// Moves, turns or scales object k of the configuration; with `on` it is set down. Error: no such object, or nothing
  /// there that it could stand on; it stays where it was then.
  Result<void> set_placement(std::size_t k, const ObjectConfig& placement);
  /// In the place of all objects; `loaded`: what load_virtual_objects() makes of them. Those with `on` are set down.
  /// Error: one has nothing to stand on; the objects are then as before.
  Result<void> set_objects(VirtualObjects loaded, std::vector<ObjectConfig> objects);
  /// Where the objects are: as configured, with the height that `on` gave them.
  const std::vector<ObjectConfig>& placements() const;
  /// Objects with `on` that would tip over or that the room cuts through, a line each.
  std::vector<std::string> standing_warnings() const;
  /// The object that a ray from `eye` shows, if no surface of the room is before it. Unit direction, world.
  std::optional<std::size_t> object_at(const glm::dvec3& eye, const glm::dvec3& direction) const;
  void set_light_samples(int samples);
  void show(const ShownParts& parts);

  /// What follows from the sky alone; render() does it where this was not called. Beside it the caller may look for the
  /// markers of the camera's picture, which say where the camera stands.
  void measure_sky(const SkyImage& sky, std::uint64_t sky_id = 0);

  /// The frame is the session's own and holds until the next call. Error: the picture has another size than announced;
  /// graphics failed.
  Result<const Frame*> render(const FrameInput& input);
  /// Of the last frame; the session is spent, and its memory free when it goes.
  Composite take_composite() &&;

  /// After render() has failed with ErrorCode::device (context lost, out of graphics memory): a new renderer for the
  /// same camera, objects and light. Error: it does not start either.
  Result<void> recreate_renderer();

  const BasisVolume& volume() const;
  const LightField& light_field() const; ///< at the volume's probes, under the last sky
  const LightSet& lights() const;        ///< light samples at the objects, of the last frame

  const RenderCamera& camera() const;
  BoundingSphere object_bounds(std::size_t k) const; ///< world; radius 0 when there is no object k
  /// What the model of the room shows in a pixel of the last frame's light, scaled as a photograph: where there is no
  /// photograph from the camera's position. Sun and windows are left out.
  Rgb room_radiance(const glm::dvec2& pixel) const;
  const std::vector<std::string>& notes() const;
  std::string renderer_description() const;

private:
  struct State;
  explicit Session(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

} // namespace daylit
