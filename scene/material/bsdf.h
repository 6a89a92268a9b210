#pragma once

// Reflection and transmission at one point of a surface: microfacets of the GGX distribution (Walter et al. 2007; Heitz
// 2014), sampled by visible normals (Dupuy & Benyoub 2023), with what is reflected more than once between them (Kulla &
// Conty 2017), a diffuse base under a dielectric (Kelemen & Szirmay-Kalos 2001) and a clear coat on top. Or, in the
// place of all that, a Lafortune lobe over a diffuse base.

#include <array>
#include <optional>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/material/albedo_table.h"
#include "scene/material/ggx.h"
#include "scene/material/lafortune.h"
#include "scene/material/material.h"

namespace daylit {

struct BsdfSample {
  glm::vec3 direction{0.0f}; ///< unit, local: towards where light comes from
  Rgb weight{0.0f};          ///< BSDF x |cos| / density
  float density = 0.0f;      ///< per sr, of all ways to find this direction
  bool transmitted = false;
};

/// Directions are unit vectors in a local frame whose z is the surface's normal on the outside and whose x is the
/// tangent; both point away from the surface. z < 0 is inside the object, or the back of an opaque or thin surface,
/// which is like its front. Radiance: light that goes through a surface is not scaled by the squared index (basic
/// radiance is kept), as a camera outside sees it: n_out^2 f(out, in) = n_in^2 f(in, out). Slopes below kLeastAlpha
/// and indices below kLeastIor count as these. Making one costs some table look-ups.
/// What comes back of 1 from everywhere, without absorption: 1 within 0.5 %, within 1.2 % where facets are stretched
/// (glass of anisotropy above 0.3: up to 20 % off from inside at grazing angles), never more than 1 under a coat.
/// A Lafortune lobe never adds light; what falls below the surface, and what the cosine takes at an angle, is lost. It
/// is reciprocal unless it rises at grazing angles.
class Bsdf {
public:
  using Lobes = std::array<std::optional<BsdfSample>, 4>; ///< coat, mirrored, passed, scattered

  explicit Bsdf(const SurfaceMaterial& material);

  /// All of it; per sr.
  Rgb f(const glm::vec3& out, const glm::vec3& in) const;
  /// Of sample(): its integral is the part of samples that goes on.
  float density(const glm::vec3& out, const glm::vec3& in) const;
  /// `u`: of the unit cube; u.z chooses the lobe. Empty where nothing goes on.
  std::optional<BsdfSample> sample(const glm::vec3& out, const glm::vec3& u) const;

  /// Without the diffuse base: what the renderer looks for with rays.
  Rgb glossy(const glm::vec3& out, const glm::vec3& in) const;
  float glossy_density(const glm::vec3& out, const glm::vec3& in) const;
  std::optional<BsdfSample> sample_glossy(const glm::vec3& out, const glm::vec3& u) const;
  /// The glossy lobes one by one, for renderers that follow each; empty where a lobe sends
  /// nothing. `u` of the unit square. What is met by more than one facet goes where the first one sends it; if that
  /// is below the surface, glass sends it to the mirror image of there, metal anywhere: right in sum, a little narrower
  /// than glossy(). Of a metal so rough that this is much, it is a lobe of its own and goes anywhere. Without
  /// absorption the weights of metal and glass add up to 1.
  Lobes sample_lobes(const glm::vec3& out, const glm::vec2& u) const;
  /// What sample_lobes() would say of a direction on the side of `out`, where it is no plane's: weight and density of
  /// coat and mirrored; nothing of what passes or is scattered, whose density it gives as 0.
  Lobes mirroring_lobes(const glm::vec3& out, const glm::vec3& in) const;
  /// Reflectance of the diffuse base seen from `out`, under light from everywhere: exactly f without glossy,
  /// integrated.
  Rgb diffuse_albedo(const glm::vec3& out) const;
  /// The diffuse base alone; per sr: diffuse_albedo(out) base_share(in) / pi.
  Rgb diffuse(const glm::vec3& out, const glm::vec3& in) const;
  /// What of light from there comes down to the diffuse base, by the mean over light from everywhere.
  float base_share(const glm::vec3& in) const;
  /// Of a ray from `out`: what is mirrored and what goes through, all roughness of the lobes together. Under a rough
  /// coat up to some percent too much.
  Rgb reflected_albedo(const glm::vec3& out) const;
  Rgb transmitted_albedo(const glm::vec3& out) const;

  static constexpr float kLeastIor = 1.001f; ///< below, no facet can be told from the bend of light
  static constexpr float kCoatIor = 1.5f;    ///< KHR_materials_clearcoat

private:
  /// Directional albedos from one direction.
  struct Seen {
    glm::vec2 mirror{0.0f};     ///< AlbedoTable::mirror
    glm::vec2 dielectric{0.0f}; ///< AlbedoTable::dielectric; thin: through as mirror
    float opaque = 0.0f;        ///< reflected once by a boundary in front of an opaque base
    float coat = 0.0f;          ///< times the coat's share
    float rest() const;         ///< of light at a transparent boundary, met by more than one facet
  };
  enum class Lobe { coat, mirrored, passed };
  /// Parts of light that one facet sends on.
  struct Facet {
    Rgb mirrored{0.0f}, passed{0.0f};
    float clear = 1.0f; ///< of 1, what a boundary between clear sides mirrors
    float mirrored_share() const;
  };
  /// Chances of the ways to sample; their sum is 1, or 0.
  struct Ways {
    float coat = 0.0f, facets = 0.0f, same_side = 0.0f, other_side = 0.0f;
  };
  SurfaceMaterial m_;
  Ggx facets_, coat_facets_;
  const AlbedoTable *mirror_, *dielectric_, *coat_;
  bool solid_;                          ///< transparent with an inside
  float mirror_rest_ = 0.0f;            ///< mean over light from everywhere
  Rgb metal_rest_{0.0f};                ///< part of it that a metal keeps
  float rest_[2] = {0.0f, 0.0f};        ///< mean of Seen::rest, outside and inside
  float passed_rest_[2] = {0.0f, 0.0f}; ///< part of the rest that goes through, from outside and from inside
  float base_ = 1.0f;                   ///< mean of base_light()

  static constexpr float kLeastCosine = 1e-6f; ///< closer to the surface nothing is seen
  static glm::vec3 mirrored_z(const glm::vec3& w) { return {w.x, w.y, -w.z}; }
  static glm::vec3 cosine_direction(const glm::vec2& u); ///< above, as dense as the cosine
  static glm::vec3 turned(const glm::vec3& w, float side) { return w.z * side < 0.0f ? mirrored_z(w) : w; }
  int side(const glm::vec3& w) const { return solid_ && w.z < 0.0f ? 1 : 0; }
  float relative_ior(const glm::vec3& out) const { return side(out) == 1 ? 1.0f / m_.ior : m_.ior; }
  Seen seen(const glm::vec3& w) const;
  float base_light(const Seen& seen) const;
  float mean_base_light() const;
  LafortunePeak peak(const glm::vec3& out) const;
  Facet facet(float cosine, int side) const;
  Rgb rest_reflected(const Seen& out, const Seen& in, int side) const;
  Rgb rest_passed(const Seen& out, const Seen& in, int side) const;
  bool is_smooth() const { return !coat_ && facets_.alpha_u <= kLeastAlpha && facets_.alpha_v <= kLeastAlpha; }
  Lobes smooth_lobes(const glm::vec3& out) const;
  static float unstopped(const Ggx& facets, const glm::vec3& up, const glm::vec3& in, float side_wanted);
  float below_coat(const glm::vec3& out) const;
  static Lobes seen_from(const glm::vec3& out, Lobes lobes);
  void facet_lobes(const glm::vec3& up, const glm::vec3& h, int side, float below_coat, const glm::vec2& u,
                   Lobes& lobes) const;
  void coat_lobe(const glm::vec3& up, const glm::vec3& h, Lobes& lobes) const;
  Rgb reflected(const glm::vec3& out, const glm::vec3& in, const Seen& seen_out, const Seen& seen_in) const;
  Rgb passed(const glm::vec3& out, const glm::vec3& in, const Seen& seen_out, const Seen& seen_in) const;
  Ways ways(const glm::vec3& out, bool with_base) const;
  float density(const Ways& ways, const glm::vec3& out, const glm::vec3& in) const;
  std::optional<glm::vec3> direction(const Ways& ways, const glm::vec3& out, const glm::vec3& u) const;
  std::optional<BsdfSample> sample(const glm::vec3& out, const glm::vec3& u, bool with_base) const;
};

} // namespace daylit
