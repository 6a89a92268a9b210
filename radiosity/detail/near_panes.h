#pragma once

#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "radiosity/detail/plane_groups.h"
#include "scene/room/pane_outline.h"
#include "scene/room/room.h"

namespace daylit::radiosity {

/// How long facet edges may be on sills and on the reveals beside them, whose irradiance from the sky falls off beside
/// the pane: 0.7 of the distance to its outline, w / 4 at least, where w is its width, the shorter side; w / 32 on a
/// sill below a frame, which lies in its shadow; at a lower corner of the outline, where a sill and a reveal light each
/// other, as long as the distance to that, w / 16 at least. Up to w / 2 above the sill: things stand there. Sills and
/// reveals are planes that stand across a pane and end within w / 2 on its inner side; a sill is level. Where the pane
/// stands back from the outside of its wall they begin up to w / 8 outside; then those count that reach w / 6 inside.
/// Of a wall that begins at a pane only a small part lies beside it, and the wall in which a pane lies does not see it.
/// Panes without a sill count nothing, those of skylights.
class NearPanes {
public:
  /// `origin`: of the frame of `groups` and edge_m(), in the frame of the panes.
  NearPanes(std::span<const Aperture> panes, const glm::dvec3& origin, std::span<const PlaneGroup> groups);

  /// No pane asks for anything.
  bool empty() const;
  /// At a point of a group; infinite where no pane asks for less.
  double edge_m(const glm::dvec3& p, std::size_t group) const;

private:
  struct PaneAboveSill {
    PaneOutline outline;
    std::vector<glm::dvec3> lower_corners;
    double sill_z_m;
  };
  static bool is_reveal(const PlaneGroup& group, const PaneOutline& pane);
  static bool is_sill(const PlaneGroup& group, const PaneOutline& pane);

  std::vector<std::vector<PaneAboveSill>> panes_; ///< of each group
};

} // namespace daylit::radiosity
