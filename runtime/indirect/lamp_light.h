#pragma once

// Light of virtual objects that shine, once the real room has reflected it: a lamp lights the walls, the walls light
// each other, the floor and the objects. What the lamp sends straight is receiver.h's.
//
// Rays from the lamps carry their power to the patches of the room; from there on E = E_lamp + sum F rho E, solved
// over all patches (radiosity; Goral et al. 1984). What the objects hide of light between patches is left out.

#include <cstddef>
#include <numbers>
#include <span>
#include <unordered_map>
#include <vector>

#include "runtime/indirect/occluded_directions.h"
#include "runtime/indirect/room_patches.h"
#include "runtime/object/object_surface.h"
#include "runtime/object/placed_parts.h"

namespace daylit {

/// Patches that a point sees past the objects. `far`: those in directions where nothing else counts what comes straight
/// from the lamps and is reflected once.
struct LampView {
  std::vector<SeenPatch> all, far;
};

/// Keeps references to everything given. Looking is thread-safe, setting is not.
class LampLight {
public:
  LampLight(const RayScene& room_rays, const RoomPatches& patches, const PlacedParts& parts)
      : rays_(room_rays), patches_(patches), parts_(parts) {}

  /// After the parts moved: `surface`, theirs, world. Without emission nothing is done.
  void set_lamps(const ObjectSurface& surface);
  bool any() const { return any_; }

  /// Of point x in the air with normal n; is_near(position): somebody else counts light reflected there once.
  template <class Near>
  LampView look(const glm::dvec3& x, const glm::dvec3& n, const DirectionPattern& pattern, const Near& is_near) const {
    LampView view;
    const auto each = static_cast<float>(std::numbers::pi / static_cast<double>(pattern.points().size()));
    look_around(rays_, x, n, pattern, [&](std::uint32_t triangle, const glm::dvec3& position, const glm::dvec3& w) {
      if (parts_.between(x, position))
        return;
      RoomPatch* patch = patches_.at(triangle, position, w);
      add_patch(view.all, patch, each);
      if (!is_near(position))
        add_patch(view.far, patch, each);
    });
    return view;
  }
  /// Irradiance from there, W/m^2.
  static Rgb irradiance(const LampView& view) { return irradiance(view.all, view.far); }
  /// Nine coefficients of the radiance that arrives at world point x of a part, but of what a lamp's light reflected
  /// once brings from nearer than IndirectFeedback looks.
  Sh9Rgb at_part(std::size_t part, const glm::dvec3& x) const;

private:
  struct Known {
    RoomPatch* patch = nullptr;
    float area_m2 = 0.0f;
    std::vector<SeenPatch> around; ///< weights: pi F
  };
  static Rgb irradiance(std::span<const SeenPatch> all, std::span<const SeenPatch> far);
  std::size_t number_of(RoomPatch* patch);
  void shoot(const ObjectSurface& surface);
  void find_all();
  void solve();

  const RayScene& rays_;
  const RoomPatches& patches_;
  const PlacedParts& parts_;
  bool any_ = false;
  std::vector<Known> known_; ///< all that light reaches
  std::size_t looked_ = 0;   ///< the first of them know what is around
  std::unordered_map<RoomPatch*, std::size_t> number_;
};

} // namespace daylit
