#pragma once

// The GGX distribution of microfacets (Trowbridge & Reitz 1975; Walter et al. 2007), anisotropic, with Smith masking.
// Directions are unit vectors in a local frame, z the surface's mean normal.

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace daylit {

struct Ggx {
  float alpha_u = 1.0f, alpha_v = 1.0f; ///< slopes along x and y, > 0

  /// Area of facets with this normal per area of surface, per sr (Heitz 2014, eq. 84). `h`.z > 0.
  float distribution(const glm::vec3& h) const;
  /// Ratio of hidden to seen projected area (Heitz 2014, eq. 86). `w`.z != 0; both sides alike.
  float lambda(const glm::vec3& w) const;
  /// Part of the facets that `w` sees.
  float masking(const glm::vec3& w) const { return 1.0f / (1.0f + lambda(w)); }
  /// Part of the facets that both see: heights correlated (Heitz 2014, eq. 99). Used for light that goes through too.
  float masking(const glm::vec3& a, const glm::vec3& b) const { return 1.0f / (1.0f + lambda(a) + lambda(b)); }

  /// Normal of a facet as seen from `w`, w.z > 0 (Dupuy & Benyoub 2023, listing 3); `u` of the unit square.
  glm::vec3 sample_visible(const glm::vec3& w, const glm::vec2& u) const;
  /// The place of the unit square from which sample_visible() makes `h`, a facet's normal that `w` sees.
  glm::vec2 invert_visible(const glm::vec3& w, const glm::vec3& h) const;
  /// Density of sample_visible(), per sr of `h` (Heitz 2018, eq. 3).
  float visible_density(const glm::vec3& w, const glm::vec3& h) const;
};

} // namespace daylit
