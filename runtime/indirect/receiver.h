#pragma once

// What virtual objects do to the indirect light of one point of the room.

#include <optional>
#include <span>
#include <vector>

#include "runtime/indirect/occluded_directions.h"
#include "runtime/indirect/room_light.h"
#include "runtime/indirect/room_patches.h"
#include "runtime/indirect/room_planes.h"
#include "runtime/indirect/window_visibility.h"
#include "runtime/object/object_surface.h"

namespace daylit {

/// At a point of the room.
struct IndirectChange {
  Rgb irradiance{0.0f}; ///< Delta E
  Rgb before{0.0f};     ///< irradiance without the objects, sun excepted
};

/// What does not depend on the light.
struct Receiver {
  /// The directions, cos dw in sr together, in which one patch of the room is behind the objects.
  struct Hidden {
    RoomPatch* patch = nullptr;
    float weight = 0.0f;
  };
  std::vector<OccludedDirection> occluded; ///< until an object moves
  std::vector<Hidden> hidden;              ///< the same
  std::optional<float> window_visibility;  ///< past the room
};

/// The room and the objects in it, with their light. Keeps references to what the constructor is given.
struct LitScene {
  const RayScene& rays;
  const RoomLight& light;
  RoomPlanes planes;
  WindowVisibility windows;
  RoomPatches patches;
  PlacedParts parts;
  std::vector<TwoSided> radiance; ///< outgoing, of the objects' vertices

  LitScene(const Room& room, const RayScene& room_rays, std::span<const Aperture> apertures,
           const RoomLight& room_light)
      : rays(room_rays), light(room_light), planes(room), windows(room_rays, apertures),
        patches(room, room_rays, planes, room_light) {}

  /// Traces the directions from x with normal n; what of the receiver still holds is kept.
  void trace(const glm::dvec3& x, const glm::dvec3& n, const DirectionPattern& pattern, Receiver& receiver) const;
  /// The change at point x of a triangle on the side that `direction` meets.
  IndirectChange change(const Receiver& receiver, std::uint32_t triangle, const glm::dvec3& x,
                        const glm::dvec3& direction) const;
  /// The sun's light that one side of an object's surface reflects.
  Rgb reflected_sun(const glm::dvec3& x, const glm::dvec3& n, const Rgb& reflectance) const;
  /// From the middle of the nearest object, in its radii.
  double radii_away(const glm::dvec3& x) const;
  std::uint32_t facing_of(std::uint32_t triangle, const glm::dvec3& direction) const {
    return planes.facing_of(triangle, direction);
  }
  const glm::dvec3& normal_of(std::uint32_t triangle, const glm::dvec3& direction) const {
    return planes[planes.facing_of(triangle, direction)].normal;
  }
};

} // namespace daylit
