#pragma once

// Where daylight can enter: window panes (by material name) and plain holes in the walls.

#include <limits>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/room/ray_scene.h"
#include "scene/room/room.h"

namespace daylit {

struct ApertureReport {
  int window_polygons = 0, hole_polygons = 0;
  double window_area_m2 = 0, hole_area_m2 = 0;
  /// Fraction of test rays from the air of the room that leave through no listed aperture: a hole whose outline could
  /// not be found. 0 for a tight room.
  double unexplained_escape = 0;
  std::vector<std::string> notes;
};

struct Apertures {
  std::vector<Aperture> list; ///< convex, planar; a concave or many-cornered opening is several of them
  ApertureReport report;
};

/// Windows are the faces with window materials, coplanar neighbours merged. Holes are planar loops of open edges
/// through which rays really leave to infinity; the open underside of a box standing on the floor is none.
/// Error geometry_invalid: neither window nor hole (says what to do).
Result<Apertures> find_apertures(const Room& room, const RayScene& scene);

/// Product of the transmittances, at the angle of d, of the panes that the segment or ray from p in unit direction d
/// crosses up to `distance` metres (infinity allowed); 1 when it crosses none. `crossed` counts apertures (holes too).
Rgb aperture_transmittance(const std::vector<Aperture>& apertures, const glm::dvec3& p, const glm::dvec3& d,
                           double distance, int* crossed = nullptr);

/// aperture_transmittance() for many rays: what the test of an aperture needs is found once.
class ApertureCrossings {
public:
  explicit ApertureCrossings(const std::vector<Aperture>& apertures);
  struct Met {
    Rgb transmittance{1.0f}; ///< as aperture_transmittance()
    int count = 0;
    double nearest_m = std::numeric_limits<double>::infinity();
  };
  /// On the way from p in unit direction d, up to `distance` metres (infinity allowed).
  Met met(const glm::dvec3& p, const glm::dvec3& d, double distance) const;

private:
  struct Outline {
    glm::dvec3 turn{0.0};   ///< unit normal about which the corners turn left
    glm::dvec3 middle{0.0}; ///< of the corners
    double radius_m = 0;    ///< of the sphere about the middle that holds the corners
    double tolerance_m = 0;
  };
  std::vector<Aperture> apertures_;
  std::vector<Outline> outline_;
};

} // namespace daylit
