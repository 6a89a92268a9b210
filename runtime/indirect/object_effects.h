#pragma once

// What virtual objects do to each other's indirect light: one hides part of the room from the other and sends light
// instead. Direct light is kept apart by rays or shadow maps.
//
// At the points of a lattice in an object's box, the radiance that arrives changes by L_other - L_room behind it in the
// directions that other objects cover. Nine coefficients of that change are interpolated to the vertices and multiplied
// with their transfer vectors, as the room's light is: nothing depends on the number of vertices but that. The light
// that comes back once more is left out.

#include <array>
#include <span>
#include <vector>

#include "runtime/indirect/box_lattice.h"
#include "runtime/indirect/occluded_directions.h"
#include "runtime/indirect/room_light.h"
#include "runtime/indirect/room_planes.h"
#include "runtime/indirect/window_visibility.h"
#include "runtime/object/relight.h"
#include "runtime/object/self_visibility.h"

namespace daylit {

/// One side of a vertex that another object is near: what it sees of the others past its own object.
struct ContactView {
  float share = 0.0f;                     ///< how much it counts beside the lattice, 0 to 1
  std::vector<OccludedDirection> covered; ///< weights: V cos dw, sr
  float blocked = 0.0f;                   ///< part of the windows' light that the others keep away
};

/// Keeps references to everything given.
class OtherObjects {
public:
  OtherObjects(const RayScene& room_rays, const RoomPatches& patches, const WindowVisibility& windows)
      : rays_(room_rays), patches_(patches), windows_(windows) {}

  /// Traces rays where any(). `parts` must live until the next call.
  void set_objects(const PlacedParts& parts);
  /// Some object is large enough as seen from another. The rest has no effect where none is.
  bool any() const;
  void room_changed() { room_known_ = false; } ///< another frame of patches and windows
  /// `radiance`: outgoing, of each vertex of all objects. After the frame of patches and windows.
  void set_light(std::span<const TwoSided> radiance);
  /// Change of the radiance that arrives at a point of a part.
  Sh9Rgb change(std::size_t part, const glm::dvec3& x) const;
  /// Of a vertex at x of a part, until an object moves. Nine coefficients blur what touches.
  ContactView contact_view(std::size_t part, const glm::dvec3& x, const SenderSide& side) const;
  /// Change of its irradiance, by that.
  Rgb change(const ContactView& view, std::span<const TwoSided> radiance) const;

private:
  struct LatticePoint {
    bool used = false; ///< some vertex that sends light lies beside it
    bool open = true;  ///< not inside another object
    std::vector<OccludedDirection> occluded;
    std::vector<std::array<float, 9>> weight; ///< of each: dw Y_lm
    std::vector<Rgb> behind;                  ///< of each: radiance of the room that it hides
    Sh9Rgb change{};
  };
  struct Surround {
    BoxLattice lattice;
    std::vector<std::size_t> others; ///< near enough
    std::vector<LatticePoint> points;
  };
  template <class Work>
  void for_each_used(const Work& work);
  void look_around(std::size_t part, const glm::dvec3& x, LatticePoint& point) const;
  void look_behind(LatticePoint& point) const;
  Rgb behind(const OccludedDirection& covered, std::size_t k) const;
  static Sh9Rgb change_at(const LatticePoint& point, std::span<const TwoSided> radiance);

  const RayScene& rays_;
  const RoomPatches& patches_;
  const WindowVisibility& windows_;
  const PlacedParts* parts_ = nullptr;
  std::vector<Surround> surrounds_;
  bool room_known_ = false; ///< LatticePoint::behind is of this frame
};

} // namespace daylit
