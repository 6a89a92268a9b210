#include "simulate/glossy_surface.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "scene/material/fresnel.h"
#include "scene/material/ggx.h"

namespace daylit {

namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kLeastCosine = 0.02f; // of a normal with normal map to the path

Ggx facets_of(const SurfaceMaterial& m) { return {std::max(m.alpha_u, kLeastAlpha), std::max(m.alpha_v, kLeastAlpha)}; }
Ggx coat_of(const SurfaceMaterial& m) {
  const float alpha = std::max(m.clearcoat_alpha, kLeastAlpha);
  return {alpha, alpha};
}

/// Density D |h.z|: tan^2 = u / (1 - u) along the stretched slopes.
glm::vec3 sample_normal(const Ggx& facets, const glm::vec2& u) {
  const float slope = std::sqrt(u.x / (1.0f - u.x)), angle = 2.0f * kPi * u.y;
  return glm::normalize(
      glm::vec3(facets.alpha_u * slope * std::cos(angle), facets.alpha_v * slope * std::sin(angle), 1.0f));
}
float normal_density(const Ggx& facets, const glm::vec3& h) { return facets.distribution(h) * std::abs(h.z); }

glm::vec3 sample_cosine_z(const glm::vec2& u) {
  const float r = std::sqrt(u.x), angle = 2.0f * kPi * u.y;
  return {r * std::cos(angle), r * std::sin(angle), std::sqrt(1.0f - u.x)};
}

/// Of directions mirrored at normals of that density.
float mirrored_density(const Ggx& facets, const glm::vec3& out, const glm::vec3& in) {
  const glm::vec3 h = glm::normalize(out + in);
  return normal_density(facets, h) / (4.0f * std::max(std::abs(glm::dot(out, h)), 1e-7f));
}

/// Of directions bent at normals of that density, `ior` behind over in front (Walter et al. 2007, eq. 17).
float bent_density(const Ggx& facets, const glm::vec3& out, const glm::vec3& in, float ior) {
  glm::vec3 h = glm::normalize(out + ior * in);
  if (h.z < 0.0f)
    h = -h;
  const float cos_out = glm::dot(out, h), cos_in = glm::dot(in, h);
  if (cos_out <= 0.0f || cos_in >= 0.0f)
    return 0.0f;
  const float s = cos_out + ior * cos_in;
  return normal_density(facets, h) * ior * ior * -cos_in / (s * s);
}

glm::vec3 other_z(const glm::vec3& w) { return {w.x, w.y, -w.z}; }

} // namespace

// A normal that faces away from the path is bent to where it does not (Keller et al. 2017, chapter 3).
GlossySurface::GlossySurface(const SurfaceLook& look, const SurfacePoint& point, const glm::vec3& from)
    : material_(look.material), bsdf_(material_), normal_(look.normal) {
  const glm::vec3 side = point.outside ? from : -from;
  if (const float away = glm::dot(normal_, side); away < kLeastCosine)
    normal_ = glm::normalize(normal_ + (kLeastCosine - away) * side);
  const glm::vec3 t = look.tangent - glm::dot(look.tangent, normal_) * normal_;
  tangent_ = glm::dot(t, t) > 1e-8f ? glm::normalize(t) : around_axis(normal_);
  bitangent_ = glm::cross(normal_, tangent_);
  out_ = to_local(from);

  const float base = luminance(bsdf_.diffuse_albedo(out_)), mirrored = luminance(bsdf_.reflected_albedo(out_)),
              passed = luminance(bsdf_.transmitted_albedo(out_)), all = base + mirrored + passed;
  base_share_ = all > 0.0f ? base / all : 1.0f;
  const float through = mirrored + passed > 0.0f ? passed / (mirrored + passed) : 0.0f;
  const Ggx facets = facets_of(material_);
  // Light met by several facets goes everywhere; there is the more of it the rougher they are.
  const float spread = 0.5f * std::sqrt(std::max(facets.alpha_u, facets.alpha_v));
  const float coat = material_.clearcoat > 0.0f ? 0.5f * (1.0f - through) : 0.0f, bare = 1.0f - through - coat;
  ways_ = {coat, bare * (1.0f - spread), through * (1.0f - spread), bare * spread, through * spread};
}

glm::vec3 GlossySurface::to_local(const glm::vec3& v) const {
  return {glm::dot(v, tangent_), glm::dot(v, bitangent_), glm::dot(v, normal_)};
}
glm::vec3 GlossySurface::to_world(const glm::vec3& v) const {
  return glm::normalize(v.x * tangent_ + v.y * bitangent_ + v.z * normal_);
}

float GlossySurface::ior_behind() const {
  const float ior = std::max(material_.ior, Bsdf::kLeastIor);
  return out_.z < 0.0f ? 1.0f / ior : ior;
}

Rgb GlossySurface::base(const glm::vec3& in) const {
  const glm::vec3 local = to_local(in);
  return bsdf_.diffuse(out_, local) * std::abs(local.z);
}
Rgb GlossySurface::glossy(const glm::vec3& in) const {
  const glm::vec3 local = to_local(in);
  return bsdf_.glossy(out_, local) * std::abs(local.z);
}

float GlossySurface::base_density(const glm::vec3& in) const { return std::max(0.0f, glm::dot(in, normal())) / kPi; }

std::optional<glm::vec3> GlossySurface::sample_glossy(const glm::vec2& u, float choice) const {
  const bool below = out_.z < 0.0f;
  const glm::vec3 out = below ? other_z(out_) : out_;
  const Ways& w = ways_;
  glm::vec3 in;
  if (choice < w.coat + w.mirrored + w.passed) {
    const glm::vec3 h = sample_normal(choice < w.coat ? coat_of(material_) : facets_of(material_), u);
    const float c = glm::dot(out, h);
    if (c <= 0.0f)
      return std::nullopt;
    in = 2.0f * c * h - out;
    if (choice >= w.coat + w.mirrored) {
      const auto bent = is_solid() ? refracted(out, h, ior_behind()) : std::optional(other_z(in));
      if (!bent || bent->z >= 0.0f)
        return std::nullopt;
      in = *bent;
    } else if (in.z <= 0.0f) {
      return std::nullopt;
    }
  } else {
    in = sample_cosine_z(u);
    if (choice >= w.coat + w.mirrored + w.passed + w.same_side)
      in = other_z(in);
  }
  return to_world(below ? other_z(in) : in);
}

float GlossySurface::glossy_density(const glm::vec3& world) const {
  const bool below = out_.z < 0.0f;
  const glm::vec3 local = to_local(world), out = below ? other_z(out_) : out_, in = below ? other_z(local) : local;
  const Ggx facets = facets_of(material_);
  if (in.z > 0.0f) {
    const float coat = ways_.coat > 0.0f ? ways_.coat * mirrored_density(coat_of(material_), out, in) : 0.0f;
    return coat + ways_.mirrored * mirrored_density(facets, out, in) + ways_.same_side * in.z / kPi;
  }
  const float bent =
      is_solid() ? bent_density(facets, out, in, ior_behind()) : mirrored_density(facets, out, other_z(in));
  return ways_.passed * bent + ways_.other_side * -in.z / kPi;
}

} // namespace daylit
