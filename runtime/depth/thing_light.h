#pragma once

// Shadows of virtual objects on real things that the room's model lacks.

#include <span>

#include "runtime/depth/real_things.h"
#include "runtime/indirect/room_light.h"
#include "runtime/object/object_rays.h"
#include "runtime/sky/direct_light.h"
#include "scene/room/aperture.h"

namespace daylit {

/// Keeps references to all. Thread-safe.
struct ThingLight {
  const RayScene& rays; ///< of the room's model
  const RoomLight& light;
  const LightSet& lights;
  std::span<const SkyMap> pyramid; ///< sky_map_pyramid()
  std::span<const ApertureCell> cells;
  const ApertureCrossings& windows;
  const ObjectRays& objects;

  /// Light with over light without the objects at a point of a thing, per channel: what its radiance is multiplied
  /// with. Of the direct light; what the objects do to the indirect light there is left out.
  Rgb ratio(const ThingPoint& point) const;
};

} // namespace daylit
