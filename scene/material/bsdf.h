#pragma once

// Reflection and transmission at one point of a surface: microfacets of the GGX distribution (Walter et al. 2007; Heitz
// 2014), sampled by visible normals (Heitz 2018), with what is reflected more than once between them (Kulla & Conty
// 2017), a diffuse base under a dielectric (Kelemen & Szirmay-Kalos 2001) and a clear coat on top.

#include <memory>
#include <optional>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/material/material.h"

namespace daylit {

struct BsdfSample {
  glm::vec3 direction{0.0f}; ///< unit, local: towards where light comes from
  Rgb weight{0.0f};          ///< BSDF x |cos| / density
  float density = 0.0f;      ///< per sr, of the whole BSDF's sampling
  bool transmitted = false;
};

/// Directions are unit vectors in a local frame whose z is the surface's normal on the outside and whose x is the
/// tangent; both point away from the surface. z < 0 is inside the object. Radiance: light that goes through a surface
/// is not scaled by the squared index (basic radiance is kept), as a camera outside sees it.
class Bsdf {
public:
  explicit Bsdf(const SurfaceMaterial& material);

  /// All of it; per sr. Symmetric in its arguments for reflection.
  Rgb f(const glm::vec3& out, const glm::vec3& in) const;
  float density(const glm::vec3& out, const glm::vec3& in) const;
  /// `u`: of the unit cube; u.z chooses the lobe. Empty where nothing goes on.
  std::optional<BsdfSample> sample(const glm::vec3& out, const glm::vec3& u) const;

  /// Without the diffuse base: what the renderer looks for with rays.
  Rgb glossy(const glm::vec3& out, const glm::vec3& in) const;
  float glossy_density(const glm::vec3& out, const glm::vec3& in) const;
  std::optional<BsdfSample> sample_glossy(const glm::vec3& out, const glm::vec3& u) const;
  /// Reflectance of the diffuse base seen from `out`, under light from everywhere.
  Rgb diffuse_albedo(const glm::vec3& out) const;
  /// Of a ray from `out`: what is mirrored and what goes through, all roughness of the lobes together.
  Rgb reflected_albedo(const glm::vec3& out) const;
  Rgb transmitted_albedo(const glm::vec3& out) const;

private:
  SurfaceMaterial m_;
};

/// Part of unpolarised light that a smooth boundary reflects; `cosine` on the side the light comes from (negative: from
/// inside), `ior`: inside over outside (Fresnel 1823).
float fresnel_dielectric(float cosine, float ior);

} // namespace daylit
