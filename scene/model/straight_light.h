#pragma once

// Light that goes straight through glass: what the shadow of a transparent object is made of (docs/materials.md).

#include <cstddef>

#include "scene/model/object_mesh.h"

namespace daylit {

/// (1 - metallic) x transmission x colour of a face, textures looked up at weights u and v of corners 1 and 2; none of
/// an opaque one.
Rgb straight_colour(const ObjectMesh& mesh, std::size_t triangle, float u, float v);
/// It is the same all over the face.
bool has_even_colour(const ObjectMesh& mesh, std::size_t triangle);
/// Part of light that is left behind one face of a mesh, textures looked up at weights u and v of corners 1 and 2: none
/// behind an opaque one. `cosine`: of the way with the outside normal, positive where it leaves the object; `way_m`:
/// metres of the way since the face before, or since its start.
Rgb straight_transmittance(const ObjectMesh& mesh, std::size_t triangle, float u, float v, float cosine, float way_m);

} // namespace daylit
