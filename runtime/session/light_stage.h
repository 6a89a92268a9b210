#pragma once

#include <vector>

#include "runtime/object/relight.h"
#include "runtime/object/virtual_objects.h"
#include "runtime/session/loaded_room.h"
#include "runtime/session/sky_stage.h"
#include "runtime/sky/direct_light.h"

namespace daylit {

/// Direct light at the objects.
struct ObjectsDirectLight {
  BoundingSphere sphere; ///< of all objects
  LightSet lights;
  std::vector<ApertureCell> cells; ///< of the windows
};

/// Which probes light the vertices.
struct ObjectsProbes {
  std::vector<VertexProbes> vertices;
  std::size_t outside = 0; ///< vertices that lie outside the light field
};

/// Indirect light that the vertices reflect.
struct ObjectsIndirectLight {
  std::vector<TwoSided> radiance;
  Ringing ringing;
};

/// From the light of the sky and the placement of the objects to the light at the objects.
class LightStage {
public:
  /// `room` must outlive it.
  explicit LightStage(LoadedRoom& room) : room_(room) {}

  /// Fills times and what was reused of samples and probes.
  void update(const SkyStage& sky, const Versioned<VirtualObjects>& objects, int samples, FrameReport& report);

  const ObjectsDirectLight& direct() const { return *direct_; }
  const ObjectsProbes& probes() const { return *probes_; }
  const ObjectsIndirectLight& indirect() const { return *indirect_; }
  Version version() const { return indirect_.version(); } ///< of all three

private:
  void add_object_effects(const SkyStage& sky, const VirtualObjects& objects, std::vector<TwoSided>& radiance) const;

  LoadedRoom& room_;
  Cached<ObjectsDirectLight> direct_;
  Cached<ObjectsProbes> probes_;
  Cached<ObjectsIndirectLight> indirect_;
};

} // namespace daylit
