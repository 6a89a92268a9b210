#pragma once

// What a microfacet surface sends on of light from everywhere, once reflected or refracted: what is missing to all of
// it was reflected more than once between the facets (Kulla & Conty 2017).

#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/material/ggx.h"

namespace daylit {

/// Directional albedos over direction and roughness, interpolated linearly. Immutable, thread-safe.
class AlbedoTable {
public:
  /// Facets that reflect all light. x: albedo; y: with each facet's (1 - cosine)^5, the rise of Schlick's formula.
  static const AlbedoTable& mirror(bool anisotropic);
  /// Facets between two transparent materials, `ior` inside over outside, 1 to 4 (rounded to 1/256). x: reflected,
  /// y: gone through. Made when first asked for: 0.2 s of one core (mirror 0.1 s), anisotropic 1.5 s (0.5 s); then
  /// kept.
  static const AlbedoTable& dielectric(float ior, bool anisotropic);

  /// `w`.z < 0 is inside. A table that is not anisotropic takes alpha_u.
  glm::vec2 at(const Ggx& facets, const glm::vec3& w) const;
  /// Mean of at() over light from everywhere on one side: the integral of at() cos / pi.
  glm::vec2 mean(const Ggx& facets, bool inside) const;
  /// mean_fresnel() of the index.
  float fresnel() const { return fresnel_; }

private:
  AlbedoTable(bool anisotropic, float ior, bool two_sided);
  struct Cell;
  struct Direction;
  template <class Albedo>
  void add_row(const Ggx& facets, Albedo&& albedo);
  glm::vec2 mean_of_row(const Ggx& facets, const glm::vec2* nodes) const;
  template <class Take>
  glm::vec2 over_roughness(const Ggx& facets, bool inside, Take&& take) const;
  bool two_sided() const { return means_.size() > static_cast<std::size_t>(roughs_) * ratios_; }

  int roughs_, ratios_, azimuths_;
  float fresnel_ = 1.0f;
  std::vector<glm::vec2> values_; ///< over side, larger slope, ratio of slopes, azimuth, cosine
  std::vector<glm::vec2> means_;  ///< over side, larger slope, ratio of slopes
};

} // namespace daylit
