#pragma once

// The light of a small sun ends at a sharp line. The patches that exchange light are too large for it: what crosses a
// patch counts as spread over all of it, and a point close to a sunlit wall is off by a tenth. So the patches are cut
// into elements (two-level hierarchy of Cohen & Wallace 1993, ch. 7). Light straight from the sky is known on elements,
// and probes see elements; only what comes after, which is smooth, is solved on the patches.

#include <cstdint>
#include <vector>

#include "precompute/detail/linear_light.h"
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
  std::vector<std::uint32_t> parent; ///< patch of each element, rising
  std::vector<float> fraction;       ///< of each element in its parent's area
  LinearLight further;               ///< what of the patches' light after further bounces each has

  /// Cuts facets in two along their longest edge until there are `count`, first those that are large (by the field) and
  /// face a visible aperture, smaller beside a pane and in corners; none that get no light from above the horizon,
  /// where suns are. `room`: its reflecting surfaces. A function of the input alone.
  static Result<LightElements> make(const radiosity::SurfaceMesh& mesh, const radiosity::PatchSet& patches,
                                    const std::vector<Aperture>& apertures, const RayScene& room,
                                    const radiosity::SizeField& field, std::size_t count);

  /// Area means over each parent's elements.
  std::vector<float> opening_of_parents(const std::vector<radiosity::FirstBounceRow>& rows) const;
  radiosity::FirstBounce of_parents(const radiosity::FirstBounce& light) const;
  /// What the elements send out: the light after further bounces of their parents, and what they reflect of the sky:
  /// b_i = sum over patches k of further_ik (b_k - reflectance_k e_k) + reflectance_i e_i, e: irradiance straight from
  /// the sky.
  radiosity::Radiosity radiosity_of(const radiosity::Radiosity& parents, const radiosity::FirstBounce& parent_light,
                                    const radiosity::FirstBounce& light) const;

private:
  void add_side(const radiosity::PatchSet& parents, std::size_t facet, int side, std::size_t first);
};

} // namespace daylit::precompute::detail
