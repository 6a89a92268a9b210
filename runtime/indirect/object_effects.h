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

namespace daylit {

/// Virtual objects stand in a room on which they cast shadows: the light that the shadowed surfaces no longer send back
/// to them, as nine coefficients at eight points of each object's box. Keeps references to everything given.
class IndirectFeedback {
public:
  IndirectFeedback(const RayScene& room_rays, const RoomPlanes& planes, const RoomLight& light,
                   const WindowVisibility& windows)
      : rays_(room_rays), planes_(planes), light_(light), windows_(windows) {}

  /// Looks around: `parts` must live until the next call.
  void set_objects(const PlacedParts& parts);
  /// After the frame of light and windows.
  void set_frame();
  /// Change of the radiance that arrives at a point of a part: trilinear between the eight points.
  Sh9Rgb change(std::size_t part, const glm::dvec3& x) const;

private:
  /// A point of the room that an object sees, and the fraction of the windows' light that the objects keep from it.
  struct SeenPoint {
    std::uint32_t triangle = 0;
    glm::dvec3 position{0.0}, direction{0.0};
    float blocked_fraction = 0.0f;
  };
  struct Surround {
    BoxLattice lattice;
    std::array<std::vector<SeenPoint>, 8> seen;
    std::array<Sh9Rgb, 8> change{};
  };
  std::vector<SeenPoint> look_around(std::size_t part, const glm::dvec3& eye) const;
  Sh9Rgb change_of(const std::vector<SeenPoint>& seen) const;

  const RayScene& rays_;
  const RoomPlanes& planes_;
  const RoomLight& light_;
  const WindowVisibility& windows_;
  const PlacedParts* parts_ = nullptr;
  std::vector<Surround> surrounds_;
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
  /// `radiance`: outgoing, of each vertex of all objects. After the frame of patches and windows.
  void set_light(std::span<const TwoSided> radiance);
  /// Change of the radiance that arrives at a point of a part.
  Sh9Rgb change(std::size_t part, const glm::dvec3& x) const;

private:
  struct LatticePoint {
    bool used = false; ///< some vertex lies beside it
    bool open = true;  ///< not inside another object
    std::vector<OccludedDirection> occluded;
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
  Sh9Rgb change_at(const LatticePoint& point, const glm::dvec3& x, std::span<const TwoSided> radiance) const;

  const RayScene& rays_;
  const RoomPatches& patches_;
  const WindowVisibility& windows_;
  const PlacedParts* parts_ = nullptr;
  std::vector<Surround> surrounds_;
};

} // namespace daylit
