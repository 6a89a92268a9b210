#include "simulate/glossy_surface.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/material/fresnel.h"
#include "scene/material/ggx.h"

namespace daylit {

namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kLeastCosine = 0.02f; // of a normal with normal map to the path
constexpr float kLobeSpread = 0.1f;   // of the paths of a Lafortune lobe: over the hemisphere

Ggx facets_of(const SurfaceMaterial& m) { return {std::max(m.alpha_u, kLeastAlpha), std::max(m.alpha_v, kLeastAlpha)}; }
Ggx coat_of(const SurfaceMaterial& m) {
  const float alpha = std::max(m.clearcoat_alpha, kLeastAlpha);
  return {alpha, alpha};
}

/// Normal of a facet as seen from `w`, w.z > 0 (Heitz 2018, listing 1): a point of the projected half ball of the
/// stretched surface.
glm::vec3 sample_normal(const Ggx& facets, const glm::vec3& w, const glm::vec2& u) {
  const glm::vec3 ball = glm::normalize(glm::vec3(facets.alpha_u * w.x, facets.alpha_v * w.y, w.z));
  const float sine2 = ball.x * ball.x + ball.y * ball.y;
  const glm::vec3 t = sine2 > 0.0f ? glm::vec3(-ball.y, ball.x, 0.0f) / std::sqrt(sine2) : glm::vec3(1.0f, 0.0f, 0.0f);
  const glm::vec3 b = glm::cross(ball, t);
  const float r = std::sqrt(u.x), angle = 2.0f * kPi * u.y, s = 0.5f * (1.0f + ball.z);
  const float x = r * std::cos(angle), y = glm::mix(std::sqrt(1.0f - x * x), r * std::sin(angle), s);
  const glm::vec3 h = x * t + y * b + std::sqrt(std::max(0.0f, 1.0f - x * x - y * y)) * ball;
  return glm::normalize(glm::vec3(facets.alpha_u * h.x, facets.alpha_v * h.y, std::max(1e-12f, h.z)));
}
/// G1 max(0, w.h) D / w.z (eq. 3).
float normal_density(const Ggx& facets, const glm::vec3& w, const glm::vec3& h) {
  return facets.masking(w) * std::max(0.0f, glm::dot(w, h)) * facets.distribution(h) / w.z;
}

glm::vec3 sample_cosine_z(const glm::vec2& u) {
  const float r = std::sqrt(u.x), angle = 2.0f * kPi * u.y;
  return {r * std::cos(angle), r * std::sin(angle), std::sqrt(1.0f - u.x)};
}

glm::vec3 other_z(const glm::vec3& w) { return {w.x, w.y, -w.z}; }
glm::vec3 upward(const glm::vec3& w) { return w.z < 0.0f ? other_z(w) : w; }

/// A power of the cosine to `peak` (Lafortune & Willems 1994, eq. 8), as height and azimuth around it.
glm::vec3 sample_power(const glm::vec3& peak, float exponent, const glm::vec2& u) {
  const float z = std::exp2(std::log2(std::max(u.x, 1e-12f)) / (exponent + 1.0f)), r = std::sqrt(1.0f - z * z);
  const glm::vec3 t = around_axis(peak), b = glm::cross(peak, t);
  return glm::normalize(z * peak + r * (std::cos(2.0f * kPi * u.y) * t + std::sin(2.0f * kPi * u.y) * b));
}
float power_density(const glm::vec3& peak, float exponent, const glm::vec3& w) {
  const float z = glm::dot(peak, w);
  return z <= 0.0f ? 0.0f : (exponent + 1.0f) / (2.0f * kPi) * std::exp2(exponent * std::log2(z));
}

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
  if (material_.lobe) {
    peak_ = material_.lobe->peak(upward(out_));
    ways_ = {0.0f, 1.0f - kLobeSpread, kLobeSpread, 0.0f};
    return;
  }
  const float through = mirrored + passed > 0.0f ? passed / (mirrored + passed) : 0.0f;
  const Ggx facets = facets_of(material_);
  // Light met by several facets goes everywhere; there is the more of it the rougher they are.
  const float spread = 0.5f * std::sqrt(std::max(facets.alpha_u, facets.alpha_v));
  const float coat = material_.clearcoat > 0.0f ? 0.5f * (1.0f - through) : 0.0f;
  ways_ = {coat, (1.0f - coat) * (1.0f - spread), (1.0f - coat) * spread * (1.0f - through),
           (1.0f - coat) * spread * through};
}

glm::vec3 GlossySurface::to_local(const glm::vec3& v) const {
  return {glm::dot(v, tangent_), glm::dot(v, bitangent_), glm::dot(v, normal_)};
}
glm::vec3 GlossySurface::to_world(const glm::vec3& v) const {
  return glm::normalize(v.x * tangent_ + v.y * bitangent_ + v.z * normal_);
}

float GlossySurface::ior_behind() const {
  const float ior = std::max(material_.ior, Bsdf::kLeastIor);
  return is_solid() && out_.z < 0.0f ? 1.0f / ior : ior;
}

/// How often a facet mirrors instead of letting through: as Fresnel's factor says.
float GlossySurface::mirrored_share(float cosine) const {
  const float f = fresnel_dielectric(cosine, ior_behind());
  const float mirrored = material_.metallic + (1.0f - material_.metallic) * f;
  const float passed = (1.0f - material_.metallic) * material_.transmission * (1.0f - f);
  return mirrored / (mirrored + passed);
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
  if (peak_ && choice < w.facets) {
    if (in = sample_power(peak_->direction, peak_->exponent, u); in.z <= 0.0f)
      return std::nullopt;
  } else if (choice < w.coat + w.facets) {
    const glm::vec3 h = sample_normal(choice < w.coat ? coat_of(material_) : facets_of(material_), out, u);
    const float c = glm::dot(out, h);
    if (c <= 0.0f)
      return std::nullopt;
    in = 2.0f * c * h - out;
    if (choice >= w.coat + w.facets * mirrored_share(c)) {
      const auto bent = is_solid() ? refracted(out, h, ior_behind()) : std::optional(other_z(in));
      if (!bent || bent->z >= 0.0f)
        return std::nullopt;
      in = *bent;
    } else if (in.z <= 0.0f) {
      return std::nullopt;
    }
  } else {
    in = sample_cosine_z(u);
    if (choice >= w.coat + w.facets + w.same_side)
      in = other_z(in);
  }
  return to_world(below ? other_z(in) : in);
}

// Directions mirrored at normals h have their density over 4 out.h, bent ones that of Walter et al. 2007, eq. 17.
float GlossySurface::glossy_density(const glm::vec3& world) const {
  const bool below = out_.z < 0.0f;
  const glm::vec3 local = to_local(world), out = below ? other_z(out_) : out_, in = below ? other_z(local) : local;
  if (peak_)
    return in.z <= 0.0f
               ? 0.0f
               : ways_.facets * power_density(peak_->direction, peak_->exponent, in) + ways_.same_side * in.z / kPi;
  const Ggx facets = facets_of(material_);
  const bool bends = in.z <= 0.0f && is_solid();
  const float ior = ior_behind();
  glm::vec3 h = glm::normalize(out + (in.z > 0.0f ? in : bends ? ior * in : other_z(in)));
  if (h.z < 0.0f)
    h = -h;
  const float c = std::max(glm::dot(out, h), 1e-7f), share = mirrored_share(c);
  const float mirrored = ways_.facets * normal_density(facets, out, h) / (4.0f * c);
  if (in.z > 0.0f) {
    const float coat = ways_.coat > 0.0f ? ways_.coat * normal_density(coat_of(material_), out, h) / (4.0f * c) : 0.0f;
    return coat + share * mirrored + ways_.same_side * in.z / kPi;
  }
  const float spread = ways_.other_side * -in.z / kPi, cos_in = glm::dot(in, h), s = c + ior * cos_in;
  if (!bends)
    return (1.0f - share) * mirrored + spread;
  if (cos_in >= 0.0f)
    return spread;
  return (1.0f - share) * ways_.facets * normal_density(facets, out, h) * ior * ior * -cos_in / (s * s) + spread;
}

} // namespace daylit
