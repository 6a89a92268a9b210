#pragma once

#include <memory>
#include <variant>
#include <vector>

#include "runtime/composite/change_picture.h"
#include "runtime/composite/compose.h"
#include "runtime/depth/real_things.h"
#include "runtime/depth/thing_layer.h"
#include "runtime/depth/thing_light.h"
#include "runtime/reflect/glossy_picture.h"
#include "runtime/reflect/object_maps.h"
#include "runtime/session/choose_renderer.h"
#include "runtime/session/light_stage.h"

namespace daylit {

/// What a picture is drawn of.
struct PictureInputs {
  const SkyStage& sky;
  const LightStage& light;
  const Versioned<VirtualObjects>& objects;
  const Versioned<RenderCamera>& camera;
  const Versioned<ShownParts>& shown;
  const LensModel& lens;
};

/// What they are drawn into.
struct PictureToChange {
  const PhotoPixels& photo;
  std::uint64_t noise_seed = 0;
  const DepthPicture* depth = nullptr; ///< of the photograph; null: none
  Version version = 0;                 ///< of both
};

/// From the light at the objects to their picture, and what they change in the picture of the room.
class PictureStage {
public:
  /// `room` must outlive it.
  PictureStage(LoadedRoom& room, ReflectBy reflect_by) : room_(room), reflect_by_(reflect_by) {}

  /// In place of the renderer before, if any. Error: it does not start.
  Result<void> start_renderer(Backend backend, const RenderSettings& settings);
  /// Gives camera and objects to the renderer, where it has others.
  Result<void> give(const Versioned<RenderCamera>& camera, const Versioned<VirtualObjects>& objects);
  /// Fills times, counts and what was reused. Error: of the renderer, which is spent.
  Result<void> update(const PictureInputs& in, FrameReport& report);
  Version version() const { return drawn_.version(); }

  /// Fills the counts of the pixels that mirror. Error: light that is not finite.
  Result<void> compose_with(const PictureToChange& picture, const PictureInputs& in, const InteriorConfig& interior,
                            Composite& result, FrameReport& report);
  const PictureRenderer& renderer() const { return **renderer_; }

private:
  Result<void> light_objects(const PictureInputs& in, std::size_t& lit);
  void change_room(const PictureInputs& in);
  const ThingLayer* find_things(const PictureToChange& picture, const PictureInputs& in, const InteriorConfig& interior,
                                const ThingLight& light);
  Result<void> add_glossy(const PictureToChange& picture, const PictureInputs& in, const PhotoScale& scale,
                          const ObjectRays& objects, const ThingLayer* things, Composite& result, FrameReport& report);
  Result<void> update_maps(const PictureToChange& picture, const PictureInputs& in, const RoomSeen& seen,
                           const GlossyRays& rays, FrameReport& report);

  LoadedRoom& room_;
  ReflectBy reflect_by_;
  Versioned<std::unique_ptr<PictureRenderer>> renderer_;
  Cached<std::monostate> given_camera_, given_objects_; ///< what the renderer has
  Cached<std::size_t> lit_;                             ///< vertices with the light that the renderer has
  Cached<RenderedFrame> drawn_;
  Cached<ViewCorners> view_;
  Cached<ChangePicture> change_; ///< of the room's indirect light
  Cached<RealThings> things_;    ///< only where a depth picture is given
  ThingLayer thing_layer_;
  Cached<std::monostate> surroundings_; ///< all that the maps show, but for the objects
  ObjectMaps maps_;
};

} // namespace daylit
