#pragma once

// The light of a small sun ends at a sharp line. The pieces of surface that exchange light are too large for it: what
// crosses a piece counts as spread over all of it, and a point close to a sunlit wall is off by a tenth. So the pieces
// are cut into leaves. Light straight from the sky is known on leaves, and probes see leaves; only what comes after,
// which is smooth, is solved on the pieces.

#include <cstdint>
#include <span>
#include <vector>

#include "radiosity/first_bounce.h"
#include "radiosity/patches.h"
#include "radiosity/solve.h"
#include "radiosity/surface_mesh.h"
#include "scene/room/aperture.h"
#include "scene/room/ray_scene.h"

namespace daylit::precompute::detail {

struct LightElements {
  radiosity::SurfaceMesh mesh;
  RayScene rays; ///< hits report facets of `mesh`
  radiosity::PatchSet patches;
  std::vector<std::uint32_t> parent; ///< patch of each leaf, rising
  std::vector<float> share;          ///< of each leaf in its parent's area

  /// Cuts facets in two along their longest edge until there are `count`, first those that are large and face an
  /// aperture in sight; none that get no light from above the horizon, where suns are. `room`: its reflecting surfaces.
  /// A function of the input alone.
  static Result<LightElements> make(const radiosity::SurfaceMesh& mesh, const radiosity::PatchSet& patches,
                                  const std::vector<Aperture>& apertures, const RayScene& room, std::size_t count);

  /// Means over each parent's leaves.
  std::vector<float> opening_of_parents(const std::vector<radiosity::FirstBounceRow>& rows) const;
  radiosity::FirstBounce of_parents(const radiosity::FirstBounce& light) const;
  /// What the leaves send out: the light after further bounces of their parents, and what the sky throws on themselves.
  radiosity::Radiosity radiosity_of(const radiosity::Radiosity& parents, const radiosity::FirstBounce& parent_light,
                                    const radiosity::FirstBounce& light) const;
};

} // namespace daylit::precompute::detail
