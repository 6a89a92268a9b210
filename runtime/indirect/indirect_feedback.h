#pragma once

// Virtual objects stand in a room on which they cast shadows: the light that the shadowed surfaces no longer send back
// to them, as nine coefficients at eight points of each object's box.

#include <array>
#include <vector>

#include "runtime/indirect/box_lattice.h"
#include "runtime/indirect/room_light.h"
#include "runtime/indirect/room_planes.h"
#include "runtime/indirect/window_visibility.h"

namespace daylit {

/// Keeps references to everything given.
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

} // namespace daylit
