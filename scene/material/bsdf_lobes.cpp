#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/material/bsdf.h"
#include "scene/material/fresnel.h"

namespace daylit {

/// What a lobe sends on in all over what it sends on of single facets, under the coat.
Rgb Bsdf::lobe_gain(Lobe lobe, const Seen& s, int where) const {
  if (lobe == Lobe::coat)
    return Rgb(m_.clearcoat);
  const float dielectric = dielectric_ ? 1.0f - m_.metallic : 0.0f, through = dielectric * m_.transmission;
  if (lobe == Lobe::passed)
    return Rgb((1.0f - s.coat) * (1.0f + passed_rest_[where] * s.rest() / std::max(s.dielectric.y, kLeastCosine)));
  const Rgb once = m_.metallic * (m_.base_colour * (s.mirror.x - s.mirror.y) + s.mirror.y) +
                   dielectric * (s.opaque + m_.transmission * (s.dielectric.x - s.opaque));
  const Rgb rest = m_.metallic * metal_rest_ * (1.0f - s.mirror.x) + through * (1.0f - passed_rest_[where]) * s.rest();
  return (1.0f - s.coat) * (1.0f + rest / glm::max(once, Rgb(kLeastCosine)));
}

/// Of a plane: all of it is one facet, which hides nothing.
std::array<std::optional<BsdfSample>, 3> Bsdf::smooth_lobes(const glm::vec3& out) const {
  std::array<std::optional<BsdfSample>, 3> lobes;
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

// F G(out, in) / G(out): visible normals (Heitz 2018, eq. 19), times lobe_gain(); their density over 4 (out.h).
std::optional<BsdfSample> Bsdf::mirrored(Lobe lobe, const glm::vec3& out, const glm::vec3& in, const Seen& s) const {
  const bool below = out.z < 0.0f, coat = lobe == Lobe::coat;
  const glm::vec3 up = below ? mirrored_z(out) : out, up_in = below ? mirrored_z(in) : in;
  if (up_in.z <= 0.0f)
    return std::nullopt;
  const glm::vec3 h = glm::normalize(up + up_in);
  const float c = glm::dot(up, h);
  const Rgb part = coat ? Rgb(fresnel_dielectric(c, kCoatIor)) : facet(c, side(out)).mirrored;
  if (part == Rgb(0.0f))
    return std::nullopt;
  const Ggx& facets = coat ? coat_facets_ : facets_;
  const float seen_by_both = facets.masking(up, up_in) / facets.masking(up);
  return BsdfSample{in, part * seen_by_both * lobe_gain(lobe, s, side(out)), facets.visible_density(up, h) / (4.0f * c),
                    false};
}

// Mirrored and refracted light share the facet.
std::array<std::optional<BsdfSample>, 3> Bsdf::sample_lobes(const glm::vec3& out, const glm::vec2& u) const {
  std::array<std::optional<BsdfSample>, 3> lobes;
  if (std::abs(out.z) < kLeastCosine)
    return lobes;
  const bool below = out.z < 0.0f;
  const glm::vec3 up = below ? mirrored_z(out) : out;
  const auto turned = [&](const glm::vec3& w) { return below ? mirrored_z(w) : w; };
  if (m_.lobe) {
    const glm::vec3 in = peak(out).sample(u);
    return in.z > 0.0f ? mirroring_lobes(out, turned(in)) : lobes;
  }
  if (is_smooth())
    return smooth_lobes(out);
  const Seen s = seen(out);
  const glm::vec3 h = facets_.sample_visible(up, u), reflection = 2.0f * glm::dot(up, h) * h - up;
  lobes[1] = mirrored(Lobe::mirrored, out, turned(reflection), s);
  if (m_.transmission > 0.0f && m_.metallic < 1.0f) {
    const auto in = solid_ ? refracted(up, h, relative_ior(out)) : mirrored_z(reflection);
    const Rgb part = facet(glm::dot(up, h), side(out)).passed;
    if (in && in->z < 0.0f && part != Rgb(0.0f))
      lobes[2] = BsdfSample{
          turned(*in), part * (facets_.masking(up, *in) / facets_.masking(up)) * lobe_gain(Lobe::passed, s, side(out)),
          0.0f, true};
  }
  if (coat_) {
    const glm::vec3 c = coat_facets_.sample_visible(up, u);
    lobes[0] = mirrored(Lobe::coat, out, turned(2.0f * glm::dot(up, c) * c - up), s);
  }
  return lobes;
}

std::array<std::optional<BsdfSample>, 3> Bsdf::mirroring_lobes(const glm::vec3& out, const glm::vec3& in) const {
  std::array<std::optional<BsdfSample>, 3> lobes;
  if (std::abs(out.z) < kLeastCosine || out.z * in.z <= 0.0f)
    return lobes;
  if (m_.lobe) {
    const LafortunePeak at = peak(out);
    const glm::vec3 up_in(in.x, in.y, std::abs(in.z));
    if (const float p = at.density(up_in); p > 0.0f)
      lobes[1] = BsdfSample{in, at.sent(up_in) / p, p, false};
    return lobes;
  }
  const Seen s = seen(out);
  lobes[1] = mirrored(Lobe::mirrored, out, in, s);
  if (coat_)
    lobes[0] = mirrored(Lobe::coat, out, in, s);
  return lobes;
}

} // namespace daylit
