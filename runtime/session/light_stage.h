#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "runtime/indirect/indirect_shadow.h"
#include "runtime/indirect/near_sunlight.h"
#include "runtime/indirect/room_light.h"
#include "runtime/indirect/vertex_light.h"
#include "runtime/object/relight.h"
#include "runtime/object/virtual_objects.h"
#include "runtime/reflect/glossy_picture.h"
#include "runtime/reflect/room_mirror.h"
#include "runtime/session/sky_stage.h"
#include "runtime/sky/direct_light.h"
#include "scene/room/ray_scene.h"
#include "scene/volume/volume.h"

namespace daylit {

/// The room of a session, read once. Its members refer to each other: it stays where it was made.
struct LoadedRoom {
  BasisVolume volume;
  LightFieldSampler sampler;
  RayScene rays, rays_of_light;
  RoomLight light;
  std::optional<IndirectShadow> indirect_shadow; ///< empty: not drawn
  ApertureCrossings windows;
  WindowVisibility window_visibility{rays, volume.apertures};
  RoomMirror mirror;

  LoadedRoom(BasisVolume v, LightFieldSampler s, RayScene r, RayScene of_light, RoomMirror m,
             bool with_indirect_shadow);
  LoadedRoom(const LoadedRoom&) = delete;
  LoadedRoom& operator=(const LoadedRoom&) = delete;
};

/// Errors: of the volume file, of its probe grid, no ray scene, a glossy material that is not there.
Result<std::unique_ptr<LoadedRoom>> load_room(const RunConfig& config);

/// Direct light at the objects.
struct ObjectsDirectLight {
  BoundingSphere sphere; ///< of all objects
  LightSet lights;
  std::vector<ApertureCell> cells; ///< of the windows
};

/// Which probes light the vertices that send light, and what of the room that objects change they see.
struct ObjectsProbes {
  std::vector<VertexProbes> vertices;
  std::size_t outside = 0; ///< those that lie outside the light field
  FeedbackTerms feedback;
  ContactViews contact;
  WindowShares windows;
  std::vector<Sh9Rgb> lamps; ///< what lamps send by way of the room; empty without
};

/// From the light of the sky and the placement of the objects to the light at the objects.
class LightStage {
public:
  /// `room` must outlive it.
  explicit LightStage(LoadedRoom& room) : room_(room), near_sun_(room.volume, room.rays_of_light, room.windows) {}

  /// Fills times and what was reused of samples and probes.
  void update(const SkyStage& sky, const Versioned<VirtualObjects>& objects, int samples, FrameReport& report);

  /// Some ray leaves an object, or meets one in a mirror of the room.
  bool needs_rays(const VirtualObjects& objects) const { return any_per_pixel(objects) || !room_.mirror.empty(); }
  const ObjectsDirectLight& direct() const { return *direct_; }
  const ObjectsProbes& probes() const { return *probes_; }
  const ObjectsIndirectLight& indirect() const { return *indirect_; }
  Version version() const { return indirect_.version(); } ///< of all three

private:
  /// At each sender, from the volume and from what the sun lights near the objects.
  std::vector<Sh9Rgb> light_of_room(const SkyStage& sky, const VirtualObjects& objects);
  /// All that the vertices send; `radiance`, what they reflect of the room's `light`, becomes what they reflect of all
  /// that does not come straight from sky and sun. Where the objects dim the room `light` becomes darker, too.
  std::vector<TwoSided> exchange_light(const SkyStage& sky, const VirtualObjects& objects,
                                       std::vector<TwoSided>& radiance, std::vector<Sh9Rgb>& light) const;
  void dim(const VirtualObjects& objects, std::vector<Sh9Rgb>& light, std::vector<TwoSided>& from_room) const;

  LoadedRoom& room_;
  NearSunlight near_sun_;
  Cached<ObjectsDirectLight> direct_;
  Cached<ObjectsProbes> probes_;
  Cached<ObjectsIndirectLight> indirect_;
};

} // namespace daylit
