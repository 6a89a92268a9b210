#pragma once

#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/room/room.h"

namespace daylit::radiosity {

/// How long facet edges may be on sills and reveals. Beside a pane their irradiance from the sky falls off within the
/// distance d to it, so that edges are at most 1.5 d there, 12 cm at least. Only within 30 cm of a pane, on its inner
/// side, and on faces that stand across it: the wall in which a pane lies does not see it.
class NearPanes {
public:
  /// `origin`: of the frame of edge_m(), in world metres.
  NearPanes(std::span<const Aperture> panes, const glm::dvec3& origin);

  /// At a point of a face with this unit normal, metres; infinite where no pane asks for less.
  double edge_m(const glm::dvec3& p, const glm::dvec3& normal) const;

private:
  struct Pane {
    std::vector<glm::dvec3> corners;
    glm::dvec3 inward;
  };
  std::vector<Pane> panes_;
};

} // namespace daylit::radiosity
