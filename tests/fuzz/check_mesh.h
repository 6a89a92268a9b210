#pragma once

#include <cmath>
#include <cstdlib>

#include "scene/model/surface_look.h"
#include "scene/model/triangle_soup.h"

namespace daylit {

/// Aborts where an index of the soup, or of the mesh that it becomes, is out of range, or a look is not finite.
inline void check_object(detail::TriangleSoup soup) {
  for (const detail::SoupTriangle& t : soup.triangles) {
    if (t.material >= soup.surfaces.materials.size())
      std::abort();
    for (const detail::SoupCorner& c : t.corner)
      if (c.position >= soup.positions.size() || c.normal >= static_cast<int>(soup.normals.size()) ||
          c.tangent >= static_cast<int>(soup.tangents.size()))
        std::abort();
  }
  const ObjectMesh mesh = detail::build_mesh(std::move(soup));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const SurfaceLook look = surface_look(mesh, t, 0.3f, 0.3f, 0.01f);
    const float sum = look.normal.x + look.tangent.x + look.material.alpha_u + look.material.base_colour.r;
    if (!std::isfinite(sum) || look.material.base_colour.r < 0.0f || look.material.base_colour.r > 1.0f)
      std::abort();
  }
}

} // namespace daylit
