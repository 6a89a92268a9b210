#pragma once

// What virtual objects do to the indirect light of one point of the room.

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "runtime/indirect/lamp_light.h"
#include "runtime/indirect/mirrored_light.h"
#include "runtime/indirect/occluded_directions.h"
#include "runtime/indirect/room_light.h"
#include "runtime/indirect/room_patches.h"
#include "runtime/indirect/room_planes.h"
#include "runtime/indirect/sunlit_points.h"
#include "runtime/indirect/window_visibility.h"
#include "runtime/object/object_surface.h"

namespace daylit {

/// At a point of the room.
struct IndirectChange {
  Rgb irradiance{0.0f}; ///< Delta E
  Rgb before{0.0f};     ///< irradiance without the objects, sun excepted
};

/// Of a point of the room, with the objects there and without.
struct RoomIrradiance {
  Rgb now{0.0f}, before{0.0f};
};

/// What does not depend on the light.
struct Receiver {
  /// A vertex of an object that sends light here.
  struct Sender {
    std::uint32_t side = 0; ///< twice its number, and 1 for its back
    float weight = 0.0f;    ///< cos dw of the directions for which it speaks, sr
  };
  /// A direction in which an object mirrors.
  struct Mirror {
    std::uint32_t side = 0; ///< of the nearest vertex
    float weight = 0.0f;
    MirroredLight::Direction from = 0; ///< where what it mirrors comes from
  };
  /// Of one object, where neither the room nor another one stands before it.
  struct View {
    std::vector<Sender> senders; ///< ascending: each once
    std::vector<Mirror> mirrors;
    std::vector<SeenPatch> hidden; ///< what of the room is behind it
  };
  std::vector<View> views;                ///< of each object, until it or one before it moves
  float surrounded = 0.0f;                ///< until an object moves: surrounded()
  std::vector<SeenPatch> around;          ///< what the room shows, found where it is first asked for
  glm::dvec3 sun{0.0};                    ///< direction that the following belongs to
  Rgb of_sun{0.0f};                       ///< what sunlit surfaces of the room send, of the sun's normal irradiance
  std::optional<float> window_visibility; ///< past the room
};

/// Part of a light, found among `all` of it by rays or points: times this, it is the same part of what the volume says.
/// The two estimates differ by some per cent, more beside a sun patch, and where most is lost little else is left.
Rgb agreement(const Rgb& volume, const Rgb& all);

/// The room and the objects in it, with their light. Keeps references to what the constructor is given.
struct LitScene {
  const Room& room;
  const RayScene& rays;
  const RoomLight& light;
  RoomPlanes planes;
  WindowVisibility windows;
  RoomPatches patches;
  PlacedParts parts;
  LampLight lamps{rays, patches, parts};
  std::vector<SunlitPoint> sunlit;
  std::vector<TwoSided> radiance; ///< outgoing, of the objects' vertices
  MirroredLight mirrored;         ///< what of them goes elsewhere

  LitScene(const Room& room_, const RayScene& room_rays, std::span<const Aperture> apertures,
           const RoomLight& room_light)
      : room(room_), rays(room_rays), light(room_light), planes(room_), windows(room_rays, apertures),
        patches(room_, room_rays, planes, room_light, windows) {}

  /// Traces the directions from x with normal n; what of the receiver still holds is kept. `holds`: of the view of an
  /// object, too; empty: of none.
  void trace(const glm::dvec3& x, const glm::dvec3& n, const DirectionPattern& pattern, Receiver& receiver,
             const std::function<bool(std::size_t part)>& holds = {}) const;
  /// Irradiance from the objects, and from the room behind them, on x with normal n.
  Rgb sent_irradiance(const Receiver& receiver) const;
  /// What of it metals send elsewhere: to be added.
  Rgb mirrored_irradiance(const Receiver& receiver) const;
  Rgb hidden_irradiance(const Receiver& receiver, const RoomPoint& here, const glm::dvec3& x,
                        const glm::dvec3& n) const;
  /// Irradiance from what a point sees of the room, but for the sun's.
  Rgb sent_by_patches(std::span<const SeenPatch> seen) const;
  /// Irradiance of x with normal n from the room's surfaces, the sunlit ones too, as the directions of the pattern see
  /// them without the objects.
  Rgb sent_by_room(const glm::dvec3& x, const glm::dvec3& n, const DirectionPattern& pattern) const;
  /// A gain is drawn as a part of the light before it. Beside a sun patch, which probes blur, that light is what the
  /// room's surfaces send: the gain times this is the same part of what the volume says. 1 without a sun, of small
  /// gains, and where the two agree to a fifth. `x` on its surface; `receiver` keeps what is found.
  Rgb gain_scale(const Rgb& gain, const Rgb& before, const RoomPoint& here, const glm::dvec3& x, const glm::dvec3& n,
                 const DirectionPattern& pattern, Receiver& receiver) const;
  /// Irradiance without the objects, sun excepted. `here`: the room's light, with the sky unshadowed.
  static Rgb before(const Receiver& receiver, const RoomPoint& here);
  /// Irradiance straight from the sun that the objects keep from point x with normal n: the mean over points of a
  /// square of that width, for its edges are sharp.
  Rgb lost_sun(const glm::dvec3& x, const glm::dvec3& n, double width_m, int points = 4) const;
  /// The light that the sunlit surfaces of the room send to x with normal n (only where `all`, else 0), and what of it
  /// the objects hide.
  struct Sunlight {
    Rgb all{0.0f}, hidden{0.0f};
  };
  Sunlight sent_by_sunlit(const glm::dvec3& x, const glm::dvec3& n, bool all) const;
  /// The sun's light that one side of an object's surface reflects.
  Rgb reflected_sun(const glm::dvec3& x, const glm::dvec3& n, const Rgb& reflectance) const;
  const Rgb& reflectance(std::uint32_t triangle) const { return room.material(room.triangles[triangle]).reflectance; }
  /// From the middle of the nearest object, in its radii.
  double radii_away(const glm::dvec3& x) const;
  /// From the sphere of the nearest object, in radii of the smallest, plus 1: of one object the same. What objects do
  /// is as wide as their surfaces are far, however large they are.
  double smallest_radii_away(const glm::dvec3& x) const;
  std::uint32_t facing_of(std::uint32_t triangle, const glm::dvec3& direction) const {
    return planes.facing_of(triangle, direction);
  }
  const glm::dvec3& normal_of(std::uint32_t triangle, const glm::dvec3& direction) const {
    return planes[planes.facing_of(triangle, direction)].normal;
  }
};

} // namespace daylit
