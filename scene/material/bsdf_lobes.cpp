#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/material/bsdf.h"
#include "scene/material/fresnel.h"

namespace daylit {

namespace {

constexpr float kScattered = 0.04f; // of light from everywhere: from there on a lobe of its own

/// Two numbers of the unit interval that look independent of `u` and of one another, where few of many samples ask.
glm::vec2 scattered(const glm::vec2& u) {
  return glm::fract(glm::vec2(97.41f * u.x + 61.83f * u.y, 71.29f * u.x + 113.57f * u.y));
}

} // namespace

/// Part of the light of a facet towards `in` that no other facet stops (Heitz 2018, eq. 19); none to the wrong side.
float Bsdf::unstopped(const Ggx& facets, const glm::vec3& up, const glm::vec3& in, float side_wanted) {
  return in.z * side_wanted > 0.0f ? facets.masking(up, in) / facets.masking(up) : 0.0f;
}

float Bsdf::below_coat(const glm::vec3& out) const { return coat_ ? 1.0f - seen(out).coat : 1.0f; }

/// Lobes of a surface from above, on the side of `out`.
Bsdf::Lobes Bsdf::seen_from(const glm::vec3& out, Lobes lobes) {
  if (out.z < 0.0f)
    for (std::optional<BsdfSample>& lobe : lobes)
      if (lobe)
        lobe->direction = mirrored_z(lobe->direction);
  return lobes;
}

/// Of a plane: all of it is one facet, which hides nothing.
Bsdf::Lobes Bsdf::smooth_lobes(const glm::vec3& out) const {
  Lobes lobes;
  const bool below = out.z < 0.0f;
  const glm::vec3 up = below ? mirrored_z(out) : out, reflection(-up.x, -up.y, up.z);
  const Facet sent = facet(up.z, side(out));
  const auto add = [&](Lobe lobe, const glm::vec3& in, const Rgb& part) {
    if (part != Rgb(0.0f))
      lobes[static_cast<std::size_t>(lobe)] = BsdfSample{below ? mirrored_z(in) : in, part, 0.0f, lobe == Lobe::passed};
  };
  add(Lobe::mirrored, reflection, sent.mirrored);
  if (const auto in = solid_ ? refracted(up, {0.0f, 0.0f, 1.0f}, relative_ior(out)) : mirrored_z(reflection))
    add(Lobe::passed, *in, sent.passed);
  return lobes;
}

// Mirrored and refracted light share the facet, and what other facets stop of both goes along with it, turned to the
// side where it comes out: in the mean over facets as much as rest_reflected() and rest_passed() send, of each facet
// without colour all light that met it. What a metal would mirror below the surface goes anywhere, `u` says where, and
// where it is much all that a metal mirrors more than once. What is turned has no density.
void Bsdf::facet_lobes(const glm::vec3& up, const glm::vec3& h, int where, float below_coat, const glm::vec2& u,
                       Lobes& lobes) const {
  const float c = glm::dot(up, h), through = m_.metallic < 1.0f ? (1.0f - m_.metallic) * m_.transmission : 0.0f;
  const glm::vec3 reflection = 2.0f * c * h - up;
  const Facet sent = facet(c, where);
  const float mirrored = unstopped(facets_, up, reflection, 1.0f);
  const Rgb rest = (1.0f - mirrored) * m_.metallic * metal_rest_;
  const bool scatters =
      mirror_rest_ * m_.metallic * std::max({metal_rest_.r, metal_rest_.g, metal_rest_.b}) > kScattered;
  Rgb reflected = mirrored * sent.mirrored + (scatters ? Rgb(0.0f) : rest);
  if (scatters && rest != Rgb(0.0f))
    lobes[3] = BsdfSample{cosine_direction(scattered(u)), below_coat * rest, 0.0f, false};
  if (through > 0.0f) {
    const auto bent = solid_ ? refracted(up, h, where == 1 ? 1.0f / m_.ior : m_.ior) : std::nullopt;
    const glm::vec3 in = bent.value_or(mirrored_z(reflection));
    const float passed = unstopped(facets_, up, in, -1.0f), clear = sent.clear,
                stopped = through * (clear * (1.0f - mirrored) + (1.0f - clear) * (1.0f - passed));
    reflected += (1.0f - passed_rest_[where]) * stopped;
    if (const Rgb part = passed * sent.passed + passed_rest_[where] * stopped * m_.base_colour; part != Rgb(0.0f))
      lobes[2] = BsdfSample{turned(in, -1.0f), below_coat * part, 0.0f, true};
  }
  if (reflected != Rgb(0.0f))
    lobes[1] = BsdfSample{
        m_.metallic > 0.0f && reflection.z <= 0.0f ? cosine_direction(scattered(u)) : turned(reflection, 1.0f),
        below_coat * reflected, mirrored > 0.0f ? facets_.visible_density(up, h) / (4.0f * c) : 0.0f, false};
}

void Bsdf::coat_lobe(const glm::vec3& up, const glm::vec3& h, Lobes& lobes) const {
  const float c = glm::dot(up, h);
  const glm::vec3 in = 2.0f * c * h - up;
  if (const float open = unstopped(coat_facets_, up, in, 1.0f); open > 0.0f)
    lobes[0] = BsdfSample{in, Rgb(m_.clearcoat * fresnel_dielectric(c, kCoatIor) * open),
                          coat_facets_.visible_density(up, h) / (4.0f * c), false};
}

Bsdf::Lobes Bsdf::sample_lobes(const glm::vec3& out, const glm::vec2& u) const {
  if (std::abs(out.z) < kLeastCosine)
    return {};
  const glm::vec3 up = turned(out, 1.0f);
  if (m_.lobe) {
    const glm::vec3 in = peak(out).sample(u);
    return in.z > 0.0f ? mirroring_lobes(out, turned(in, out.z)) : Lobes{};
  }
  if (is_smooth())
    return smooth_lobes(out);
  Lobes lobes;
  facet_lobes(up, facets_.sample_visible(up, u), side(out), below_coat(out), u, lobes);
  if (coat_)
    coat_lobe(up, coat_facets_.sample_visible(up, u), lobes);
  return seen_from(out, lobes);
}

Bsdf::Lobes Bsdf::mirroring_lobes(const glm::vec3& out, const glm::vec3& in) const {
  Lobes lobes;
  if (std::abs(out.z) < kLeastCosine || out.z * in.z <= 0.0f)
    return lobes;
  const glm::vec3 up = turned(out, 1.0f), up_in = turned(in, 1.0f);
  if (m_.lobe) {
    const LafortunePeak at = peak(out);
    if (const float p = at.density(up_in); p > 0.0f)
      lobes[1] = BsdfSample{in, at.sent(up_in) / p, p, false};
    return lobes;
  }
  const glm::vec3 h = glm::normalize(up + up_in);
  facet_lobes(up, h, side(out), below_coat(out), glm::vec2(0.0f), lobes);
  lobes[2].reset();
  lobes[3].reset();
  if (coat_)
    coat_lobe(up, h, lobes);
  return seen_from(out, lobes);
}

} // namespace daylit
