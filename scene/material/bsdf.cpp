#include "scene/material/bsdf.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "scene/material/fresnel.h"

namespace daylit {

namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kLeastRest = 1e-5f; // below, nothing is missing but rounding

/// Schlick 1994, eq. 15.
Rgb schlick(const Rgb& face_on, float cosine) {
  const float r = std::clamp(1.0f - cosine, 0.0f, 1.0f);
  return face_on + (1.0f - face_on) * (r * r * r * r * r);
}

/// Normal of the facet that bends `in` into `out` (Walter et al. 2007, eq. 16), on the side of `out`; `ior`: index on
/// the side of `in` over that of `out`.
glm::vec3 bending_normal(const glm::vec3& out, const glm::vec3& in, float ior) {
  const glm::vec3 h = glm::normalize(out + ior * in);
  return h.z * out.z < 0.0f ? -h : h;
}

/// Area of facet normals per area of refracted directions, per |in.h| (Walter et al. 2007, eq. 17).
float bending_jacobian(float cos_out, float cos_in, float ior) {
  const float s = cos_out + ior * cos_in;
  return ior * ior / (s * s);
}

} // namespace

float Bsdf::Seen::rest() const { return std::max(0.0f, 1.0f - dielectric.x - dielectric.y); }

float Bsdf::Facet::mirrored_share() const {
  const float m = luminance(mirrored), p = luminance(passed);
  return p > 0.0f ? m / (m + p) : 1.0f;
}

// F_ms = F^2 E / (1 - F (1 - E)) with the means F and E (Hill 2018; Kulla & Conty 2017 have one F less). Through a
// solid, the rest is shared as the mean Fresnel factor says, less where the two sides miss different amounts:
// reciprocal since n^2 (1 - F_inside) = 1 - F_outside.
Bsdf::Bsdf(const SurfaceMaterial& material) : m_(material), solid_(material.transmission > 0.0f && !material.thin) {
  m_.ior = std::max(m_.ior, kLeastIor);
  if (m_.lobe) {
    m_.metallic = m_.transmission = m_.clearcoat = 0.0f;
    mirror_ = dielectric_ = coat_ = nullptr;
    solid_ = false;
    return;
  }
  facets_ = {std::max(m_.alpha_u, kLeastAlpha), std::max(m_.alpha_v, kLeastAlpha)};
  coat_facets_ = {std::max(m_.clearcoat_alpha, kLeastAlpha), std::max(m_.clearcoat_alpha, kLeastAlpha)};
  const bool stretched = facets_.alpha_u != facets_.alpha_v;
  mirror_ = &AlbedoTable::mirror(stretched);
  dielectric_ = m_.metallic < 1.0f ? &AlbedoTable::dielectric(m_.ior, stretched) : nullptr;
  coat_ = m_.clearcoat > 0.0f ? &AlbedoTable::dielectric(kCoatIor, false) : nullptr;

  if (m_.metallic > 0.0f || m_.thin) {
    const float mean = mirror_->mean(facets_, false).x;
    mirror_rest_ = 1.0f - mean;
    const Rgb f = m_.base_colour + (1.0f - m_.base_colour) / 21.0f;
    metal_rest_ = f * f * mean / (1.0f - f * (1.0f - mean));
  }
  if (!dielectric_)
    return;
  const glm::vec2 outer = dielectric_->mean(facets_, false);
  if (m_.transmission < 1.0f)
    base_ = coat_ ? mean_base_light() : 1.0f - outer.x;
  if (m_.transmission == 0.0f)
    return;
  for (const int s : {0, 1}) {
    const glm::vec2 e = s == 0 ? outer : dielectric_->mean(facets_, true);
    rest_[s] = m_.thin ? mirror_rest_ : std::max(0.0f, 1.0f - e.x - e.y);
  }
  const float outside = 1.0f - dielectric_->fresnel(), most = std::max({rest_[0], rest_[1], kLeastRest});
  const float inside = m_.thin ? outside : outside / (m_.ior * m_.ior);
  passed_rest_[0] = outside * rest_[1] / most;
  passed_rest_[1] = inside * rest_[0] / most;
}

Bsdf::Seen Bsdf::seen(const glm::vec3& w) const {
  const glm::vec3 at(w.x, w.y, solid_ ? w.z : std::abs(w.z));
  Seen s;
  if (m_.metallic > 0.0f || m_.thin)
    s.mirror = mirror_->at(facets_, at);
  if (dielectric_) {
    s.dielectric = dielectric_->at(facets_, at);
    if (m_.transmission < 1.0f)
      s.opaque = side(w) == 0 ? s.dielectric.x : dielectric_->at(facets_, mirrored_z(w)).x;
    if (m_.thin)
      s.dielectric.y = s.mirror.x - s.dielectric.x;
  }
  if (coat_)
    s.coat = m_.clearcoat * coat_->at(coat_facets_, {w.x, w.y, std::abs(w.z)}).x;
  return s;
}

LafortunePeak Bsdf::peak(const glm::vec3& out) const { return m_.lobe->peak({out.x, out.y, std::abs(out.z)}); }

/// What comes down to the diffuse base.
float Bsdf::base_light(const Seen& s) const { return (1.0f - s.coat) * (1.0f - s.opaque); }

// Integral of 2 c base_light(c) by the midpoint rule in sqrt(c), over azimuths where facets are stretched.
float Bsdf::mean_base_light() const {
  constexpr int kSteps = 24;
  const int azimuths = facets_.alpha_u == facets_.alpha_v ? 1 : 4;
  float sum = 0.0f, weights = 0.0f;
  for (int a = 0; a < azimuths; ++a)
    for (int k = 0; k < kSteps; ++k) {
      const float t = (static_cast<float>(k) + 0.5f) / kSteps, c = t * t, sine = std::sqrt((1.0f - c) * (1.0f + c));
      const float angle = 0.5f * kPi * (static_cast<float>(a) + 0.5f) / static_cast<float>(azimuths);
      sum += t * c * base_light(seen({sine * std::cos(angle), sine * std::sin(angle), c}));
      weights += t * c;
    }
  return sum / weights;
}

// A boundary that lets a part of the light through is a mixture of a clear one and of one before an opaque base, which
// is the same on both sides.
Bsdf::Facet Bsdf::facet(float cosine, int s) const {
  Facet result;
  if (m_.metallic > 0.0f)
    result.mirrored = m_.metallic * schlick(m_.base_colour, cosine);
  if (m_.metallic >= 1.0f)
    return result;
  const float dielectric = 1.0f - m_.metallic;
  const float clear = result.clear = fresnel_dielectric(s == 1 ? -cosine : cosine, m_.ior);
  const float opaque = s == 1 && m_.transmission < 1.0f ? fresnel_dielectric(cosine, m_.ior) : clear;
  result.mirrored += dielectric * (opaque + m_.transmission * (clear - opaque));
  result.passed = dielectric * m_.transmission * (1.0f - clear) * m_.base_colour;
  return result;
}

/// Reflected more than once, to the same side: (1 - E(out)) (1 - E(in)) / (pi (1 - mean E)) (Kulla & Conty 2017).
Rgb Bsdf::rest_reflected(const Seen& out, const Seen& in, int s) const {
  Rgb sum(0.0f);
  if (m_.metallic > 0.0f && mirror_rest_ > kLeastRest)
    sum += m_.metallic * metal_rest_ * ((1.0f - out.mirror.x) * (1.0f - in.mirror.x) / (kPi * mirror_rest_));
  if (m_.transmission > 0.0f && m_.metallic < 1.0f && rest_[s] > kLeastRest)
    sum +=
        (1.0f - m_.metallic) * m_.transmission * (1.0f - passed_rest_[s]) * out.rest() * in.rest() / (kPi * rest_[s]);
  return sum;
}

/// The same to the other side.
Rgb Bsdf::rest_passed(const Seen& out, const Seen& in, int s) const {
  const float behind = rest_[solid_ ? 1 - s : 0];
  if (behind <= kLeastRest)
    return Rgb(0.0f);
  return (1.0f - m_.metallic) * m_.transmission * m_.base_colour *
         (passed_rest_[s] * out.rest() * in.rest() / (kPi * behind));
}

// Walter et al. 2007, eq. 20, under what the coat leaves of both directions, and the coat. The lesser of both keeps
// the sum below 1 and reciprocal (Estevez & Kulla 2017, for sheen).
Rgb Bsdf::reflected(const glm::vec3& out, const glm::vec3& in, const Seen& a, const Seen& b) const {
  const glm::vec3 sum = out + in, h = glm::normalize(sum);
  const float c = 0.5f * glm::length(sum), area = 4.0f * std::abs(out.z * in.z);
  const Rgb once = facet(c, side(out)).mirrored * (facets_.distribution(h) * facets_.masking(out, in) / area);
  const Rgb below = (once + rest_reflected(a, b, side(out))) * (1.0f - std::max(a.coat, b.coat));
  if (!coat_)
    return below;
  return below + m_.clearcoat * fresnel_dielectric(c, kCoatIor) * coat_facets_.distribution(h) *
                     coat_facets_.masking(out, in) / area;
}

// Walter et al. 2007, eq. 21, times the squared ratio of the indices; thin: the mirror image of what is reflected.
Rgb Bsdf::passed(const glm::vec3& out, const glm::vec3& in, const Seen& a, const Seen& b) const {
  Rgb once(0.0f);
  const float area = std::abs(out.z * in.z);
  if (!solid_) {
    const glm::vec3 sum = out + mirrored_z(in);
    once = facet(0.5f * glm::length(sum), 0).passed *
           (facets_.distribution(glm::normalize(sum)) * facets_.masking(out, in) / (4.0f * area));
  } else {
    const bool outside = side(out) == 0;
    const glm::vec3 &front = outside ? out : in, &behind = outside ? in : out;
    const glm::vec3 h = bending_normal(front, behind, m_.ior);
    const float cos_front = glm::dot(front, h), cos_behind = glm::dot(behind, h);
    if (cos_front > 0.0f && cos_behind < 0.0f)
      once = facet(cos_front, 0).passed *
             (facets_.distribution(h) * facets_.masking(out, in) * cos_front * -cos_behind *
              bending_jacobian(cos_front, cos_behind, m_.ior) / (outside ? area : area * m_.ior * m_.ior));
  }
  return (once + rest_passed(a, b, side(out))) * (1.0f - std::max(a.coat, b.coat));
}

Rgb Bsdf::glossy(const glm::vec3& out, const glm::vec3& in) const {
  if (std::abs(out.z) < kLeastCosine || std::abs(in.z) < kLeastCosine)
    return Rgb(0.0f);
  if (m_.lobe)
    return out.z * in.z > 0.0f ? peak(out).sent({in.x, in.y, std::abs(in.z)}) / std::abs(in.z) : Rgb(0.0f);
  if (out.z * in.z > 0.0f)
    return reflected(out, in, seen(out), seen(in));
  return m_.transmission > 0.0f && m_.metallic < 1.0f ? passed(out, in, seen(out), seen(in)) : Rgb(0.0f);
}

// colour / pi base_light(out) base_light(in) / mean (Kelemen & Szirmay-Kalos 2001, eq. 5).
Rgb Bsdf::diffuse(const glm::vec3& out, const glm::vec3& in) const {
  return out.z * in.z > 0.0f ? diffuse_albedo(out) * (base_share(in) / kPi) : Rgb(0.0f);
}

float Bsdf::base_share(const glm::vec3& in) const {
  return !m_.lobe && dielectric_ && m_.transmission < 1.0f ? base_light(seen(in)) / base_ : 1.0f;
}

Rgb Bsdf::f(const glm::vec3& out, const glm::vec3& in) const { return glossy(out, in) + diffuse(out, in); }

Rgb Bsdf::diffuse_albedo(const glm::vec3& out) const {
  if (m_.lobe)
    return m_.lobe->base(m_.base_colour, peak(out));
  if (!dielectric_ || m_.transmission >= 1.0f)
    return Rgb(0.0f);
  return (1.0f - m_.metallic) * (1.0f - m_.transmission) * m_.base_colour * base_light(seen(out));
}

Rgb Bsdf::reflected_albedo(const glm::vec3& out) const {
  if (m_.lobe)
    return peak(out).albedo();
  const Seen s = seen(out);
  Rgb below(0.0f);
  if (m_.metallic > 0.0f)
    below +=
        m_.metallic * (m_.base_colour * (s.mirror.x - s.mirror.y) + s.mirror.y + metal_rest_ * (1.0f - s.mirror.x));
  if (dielectric_)
    below += (1.0f - m_.metallic) * (s.opaque + m_.transmission * (s.dielectric.x - s.opaque) +
                                     m_.transmission * (1.0f - passed_rest_[side(out)]) * s.rest());
  return s.coat + (1.0f - s.coat) * below;
}

Rgb Bsdf::transmitted_albedo(const glm::vec3& out) const {
  if (!dielectric_ || m_.transmission <= 0.0f)
    return Rgb(0.0f);
  const Seen s = seen(out);
  return (1.0f - s.coat) * (1.0f - m_.metallic) * m_.transmission * m_.base_colour *
         (s.dielectric.y + passed_rest_[side(out)] * s.rest());
}

/// Each way is taken as often as it sends light on; a lobe stands for the facets.
Bsdf::Ways Bsdf::ways(const glm::vec3& out, bool with_base) const {
  if (m_.lobe) {
    const LafortunePeak at = peak(out);
    const float lobe = luminance(at.albedo()),
                sum = lobe + (with_base ? luminance(m_.lobe->base(m_.base_colour, at)) : 0.0f);
    return sum > 0.0f ? Ways{.facets = lobe / sum, .same_side = 1.0f - lobe / sum} : Ways{};
  }
  const Seen s = seen(out);
  const float dielectric = dielectric_ ? 1.0f - m_.metallic : 0.0f, colour = luminance(m_.base_colour);
  const float through = dielectric * m_.transmission, passed_part = passed_rest_[side(out)];
  Ways w;
  w.coat = s.coat;
  w.facets = (1.0f - s.coat) * (m_.metallic * (colour * (s.mirror.x - s.mirror.y) + s.mirror.y) +
                                dielectric * (1.0f - m_.transmission) * s.opaque + through * s.dielectric.x +
                                through * colour * s.dielectric.y);
  w.same_side = (1.0f - s.coat) * (m_.metallic * luminance(metal_rest_) * (1.0f - s.mirror.x) +
                                   through * (1.0f - passed_part) * s.rest());
  if (with_base)
    w.same_side += dielectric * (1.0f - m_.transmission) * colour * base_light(s);
  w.other_side = (1.0f - s.coat) * through * colour * passed_part * s.rest();
  const float sum = w.coat + w.facets + w.same_side + w.other_side;
  if (!(sum > 0.0f))
    return {};
  return {w.coat / sum, w.facets / sum, w.same_side / sum, w.other_side / sum};
}

// Visible normals (Heitz 2018, eq. 17) and cosines.
float Bsdf::density(const Ways& w, const glm::vec3& out, const glm::vec3& in) const {
  if (std::abs(out.z) < kLeastCosine || std::abs(in.z) < kLeastCosine)
    return 0.0f;
  const bool same = out.z * in.z > 0.0f;
  float sum = (same ? w.same_side : w.other_side) * std::abs(in.z) / kPi;
  if (m_.lobe)
    return same ? sum + w.facets * peak(out).density({in.x, in.y, std::abs(in.z)}) : 0.0f;
  const float ior = relative_ior(out);
  if (same || !solid_) {
    const glm::vec3 up = same ? in : mirrored_z(in);
    const glm::vec3 h = glm::normalize(out + up);
    const float c = std::abs(glm::dot(out, h)), share = facet(c, side(out)).mirrored_share();
    sum += w.facets * (same ? share : 1.0f - share) * facets_.visible_density(out, h) / (4.0f * c);
    if (same && w.coat > 0.0f)
      sum += w.coat * coat_facets_.visible_density(out, h) / (4.0f * c);
    return sum;
  }
  const glm::vec3 h = bending_normal(out, in, ior);
  const float cos_out = glm::dot(out, h), cos_in = glm::dot(in, h);
  if (cos_out > 0.0f && cos_in < 0.0f)
    sum += w.facets * (1.0f - facet(cos_out, side(out)).mirrored_share()) * facets_.visible_density(out, h) * -cos_in *
           bending_jacobian(cos_out, cos_in, ior);
  return sum;
}

glm::vec3 Bsdf::cosine_direction(const glm::vec2& u) {
  const float r = std::sqrt(u.x), angle = 2.0f * kPi * u.y;
  return {r * std::cos(angle), r * std::sin(angle), std::sqrt(std::max(1.0f - u.x, 0.0f))};
}

std::optional<glm::vec3> Bsdf::direction(const Ways& w, const glm::vec3& out, const glm::vec3& u) const {
  const glm::vec3 up = out.z < 0.0f ? mirrored_z(out) : out;
  const glm::vec2 u2(u);
  std::optional<glm::vec3> in;
  if (m_.lobe && u.z < w.facets) {
    if (in = peak(out).sample(u2); in->z <= 0.0f)
      return std::nullopt;
  } else if (u.z < w.coat + w.facets) {
    const bool coat = u.z < w.coat;
    const glm::vec3 h = (coat ? coat_facets_ : facets_).sample_visible(up, u2);
    const float c = glm::dot(up, h), share = coat ? 1.0f : facet(c, side(out)).mirrored_share();
    const bool mirrored = coat || (u.z - w.coat) < share * w.facets;
    const glm::vec3 reflection = 2.0f * c * h - up;
    if (mirrored || !solid_)
      in = reflection.z <= 0.0f ? std::nullopt : std::optional(mirrored ? reflection : mirrored_z(reflection));
    else if (in = refracted(up, h, relative_ior(out)); in && in->z >= 0.0f)
      in.reset();
  } else {
    in = cosine_direction(u2);
    if (u.z >= w.coat + w.facets + w.same_side)
      in = mirrored_z(*in);
  }
  return in && out.z < 0.0f ? mirrored_z(*in) : in;
}

std::optional<BsdfSample> Bsdf::sample(const glm::vec3& out, const glm::vec3& u, bool with_base) const {
  if (std::abs(out.z) < kLeastCosine)
    return std::nullopt;
  const Ways w = ways(out, with_base);
  if (w.coat + w.facets + w.same_side + w.other_side <= 0.0f)
    return std::nullopt;
  const auto in = direction(w, out, u);
  if (!in)
    return std::nullopt;
  const float p = density(w, out, *in);
  const Rgb value = with_base ? f(out, *in) : glossy(out, *in);
  if (!(p > 0.0f) || value == Rgb(0.0f))
    return std::nullopt;
  return BsdfSample{*in, value * (std::abs(in->z) / p), p, out.z * in->z < 0.0f};
}

float Bsdf::density(const glm::vec3& out, const glm::vec3& in) const { return density(ways(out, true), out, in); }
float Bsdf::glossy_density(const glm::vec3& out, const glm::vec3& in) const {
  return density(ways(out, false), out, in);
}
std::optional<BsdfSample> Bsdf::sample(const glm::vec3& out, const glm::vec3& u) const { return sample(out, u, true); }
std::optional<BsdfSample> Bsdf::sample_glossy(const glm::vec3& out, const glm::vec3& u) const {
  return sample(out, u, false);
}

} // namespace daylit
