#pragma once

// A point of an object that is not plainly diffuse, as paths meet it. It evaluates the same BSDF as the renderer but
// finds directions in its own way: visible normals after Heitz 2018 (the renderer: Dupuy & Benyoub 2023), and cosines,
// so that a mistake of one sampling shows beside the other's picture.

#include <optional>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/material/bsdf.h"
#include "scene/model/surface_look.h"
#include "simulate/trace_scene.h"

namespace daylit {

class GlossySurface {
public:
  /// `from`: unit, away from the surface, to where the path comes from.
  GlossySurface(const SurfaceLook& look, const SurfacePoint& point, const glm::vec3& from);

  const SurfaceMaterial& material() const { return material_; }
  bool is_solid() const { return material_.transmission > 0.0f && !material_.thin; }
  /// Part of the paths that go on from the diffuse base.
  float base_share() const { return base_share_; }
  /// Unit normal on the side that the path comes from.
  glm::vec3 normal() const { return out_.z < 0.0f ? -normal_ : normal_; }

  /// BSDF times |cosine| of the base, of everything else; `in` unit, world.
  Rgb base(const glm::vec3& in) const;
  Rgb glossy(const glm::vec3& in) const;
  /// Density of a direction of the base (cosine), per sr.
  float base_density(const glm::vec3& in) const;
  /// Direction of everything else, and its density. `choice`: 0..1, of the lobe. Empty: the facet sends nothing on.
  std::optional<glm::vec3> sample_glossy(const glm::vec2& u, float choice) const;
  float glossy_density(const glm::vec3& in) const;
  /// Does a direction leave on the side that the path came from?
  bool same_side(const glm::vec3& in) const { return glm::dot(in, normal_) * out_.z > 0.0f; }

private:
  /// Chances of the ways to sample; their sum is 1.
  struct Ways {
    float coat = 0.0f, facets = 0.0f, same_side = 0.0f, other_side = 0.0f;
  };
  SurfaceMaterial material_;
  Bsdf bsdf_;
  glm::vec3 normal_{0.0f}, tangent_{0.0f}, bitangent_{0.0f};
  glm::vec3 out_{0.0f}; ///< local
  float base_share_ = 0.0f;
  std::optional<LafortunePeak> peak_; ///< of a Lafortune lobe, on the upper side: facets are its samples
  Ways ways_;

  glm::vec3 to_local(const glm::vec3& v) const;
  glm::vec3 to_world(const glm::vec3& v) const;
  float ior_behind() const; ///< over the index on the side of the path
  float mirrored_share(float cosine) const;
};

} // namespace daylit
