#pragma once

// Between which patches and openings nothing can stand.

#include <vector>

#include <glm/vec3.hpp>

#include "radiosity/detail/sky_sweep.h"
#include "radiosity/patches.h"
#include "radiosity/surface_mesh.h"

namespace daylit::radiosity {

/// Decides without rays that nothing can stand between a patch and an opening, nor outside the opening.
class OpenPaths {
public:
  OpenPaths(const SurfaceMesh& mesh, const std::vector<Aperture>& apertures, const std::vector<AperturePart>& parts);
  /// True only when no facet and no other opening meets the hull of the two, except by touching it, and nothing lies
  /// beyond the opening. `front`: the corners of the part that count.
  bool clear(const Patch& patch, std::size_t part, const std::vector<glm::dvec3>& front) const;

private:
  struct Box {
    glm::dvec3 lo, hi;
    void include(const glm::dvec3& p);
  };
  struct Sheet {
    glm::dvec3 point, normal;
    Box box;
  };
  void add_sheets(const SurfaceMesh& mesh, const std::vector<Aperture>& apertures);
  bool parted(const Sheet& sheet, const Patch& patch, const std::vector<glm::dvec3>& front, const Box& hull) const;

  std::vector<Sheet> sheets_; ///< planes of the mesh, then the openings
  std::size_t first_opening_ = 0;
  std::vector<bool> open_outside_; ///< per part
  const std::vector<AperturePart>& parts_;
  double tolerance_m_ = 0;
};

} // namespace daylit::radiosity
