#pragma once

// What virtual objects do to the light of the whole room: a lamp lights the walls, the walls light each other, the
// floor and the objects; and a large dark object, or one that stands before the window, takes light from all of them.
// What the lamp sends straight, and what an object takes straight from a surface, is receiver.h's.
//
// Rays from the lamps carry their power to the patches of the room, and what is taken is told for them; from there on
// E = E_first + sum F rho E, solved over all patches (radiosity; Goral et al. 1984). What the objects hide of light
// between patches is left out.

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

/// Patches that a point sees past the objects. `far`: those in directions where nothing else counts what changed
/// straight there and is reflected once.
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
  /// Patches that the parts see, whose light they may change as a whole; before set_lamps().
  std::vector<RoomPatch*> find_seen_by_parts();
  void forget_changes() { changes_ = false; }
  /// What the objects change of the irradiance of patches that find_seen_by_parts() found. Found again from them: what
  /// all patches receive by way of the room.
  void set_changes(std::span<RoomPatch* const> patches, std::span<const Rgb> changes);
  /// There are lamps, or light is taken.
  bool any() const { return lamps_ || changes_; }

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
  /// Nine coefficients of the radiance that arrives at world point x of a part, but of what is reflected once nearer
  /// than IndirectFeedback looks.
  Sh9Rgb at_part(std::size_t part, const glm::dvec3& x) const;

private:
  struct Known {
    RoomPatch* patch = nullptr;
    float area_m2 = 0.0f;
    Rgb lamp{0.0f};                ///< irradiance straight from the lamps
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
  bool lamps_ = false, changes_ = false;
  std::vector<Known> known_; ///< all that light reaches
  std::size_t looked_ = 0;   ///< the first of them know what is around
  std::unordered_map<RoomPatch*, std::size_t> number_;
};

} // namespace daylit
