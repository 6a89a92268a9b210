// The diffuse part of a material: the light of the vertices on it, and what a normal map and a dielectric over it do to
// it. It was drawn with the smooth normal n, with all shadows, as if light came in as it does from everywhere: here it
// is multiplied, direct and indirect light apart, by what the base under a surface of the mapped normal m receives over
// what one of n does.

#include <algorithm>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/reflect/glossy_surface.h"
#include "scene/volume/volume.h"

namespace daylit {

namespace {

constexpr float kMostRelief = 16.0f; // where light grazes n

Rgb ratio(const Rgb& mapped, const Rgb& smooth) {
  Rgb r(1.0f);
  for (int c = 0; c < 3; ++c)
    if (smooth[c] > 0.0f)
      r[c] = std::clamp(mapped[c] / smooth[c], 0.0f, kMostRelief);
  return r;
}

} // namespace

/// E / pi, of the light of the vertices.
Rgb GlossyRays::arriving_at(std::span<const TwoSided> all, const ObjectPoint& point, const Surface& s) const {
  const VirtualObjects& objects = room_.objects.objects();
  const VirtualObjects::Part& part = objects.parts[point.part];
  const auto& t = part.mesh().triangles[point.triangle];
  const float weight[3] = {1.0f - point.u - point.v, point.u, point.v};
  const bool back = glm::dot(s.normal, point.face_normal) < 0.0f;
  Rgb radiance(0.0f), reflectance(0.0f);
  for (std::size_t k = 0; k < 3; ++k) {
    const TwoSided& vertex = all[part.sender_of(t[k])];
    radiance += weight[k] * (back ? vertex.back : vertex.front);
    reflectance += weight[k] * objects.sent_reflectance(part, t[k]);
  }
  return radiance / glm::max(reflectance, Rgb(kLeastReflectance));
}

/// Of the base's colour here.
Rgb GlossyRays::diffuse_of(std::span<const TwoSided> all, const ObjectPoint& point, const Surface& s) const {
  const Rgb albedo = s.bsdf.diffuse_albedo(s.out);
  return albedo == Rgb(0.0f) ? albedo : albedo * arriving_at(all, point, s);
}

/// glTF 2.0, section 3.9.3: indirect light alone.
Rgb GlossyRays::occluded(const ObjectPoint& point, const Surface& s) const {
  return s.material.occlusion < 1.0f ? (1.0f - s.material.occlusion) * diffuse_of(indirect_, point, s) : Rgb(0.0f);
}

/// sum E max(0, m.w) B(w) / sum E n.w over the lights above the surface (n.w > 0): samples of the sky, and the sun
/// where it reaches the point. B: Bsdf::base_share().
Rgb GlossyRays::relief_of_direct(const ObjectPoint& point, const Surface& s) const {
  Rgb mapped(0.0f), smooth(0.0f);
  const auto add = [&](const glm::vec3& w, const Rgb& irradiance) {
    smooth += glm::dot(s.smooth, w) * irradiance;
    if (const glm::vec3 in = s.to_local(w); in.z > 0.0f)
      mapped += in.z * s.bsdf.base_share(in) * irradiance;
  };
  for (const DirectionalLight& l : sky_)
    if (const glm::vec3 w(l.direction); glm::dot(s.smooth, w) > 0.0f)
      add(w, l.irradiance);
  if (room_.sun)
    if (const glm::vec3 w(room_.sun->direction); glm::dot(s.smooth, w) > 0.0f)
      if (const auto x = lit_from(point, s, w))
        add(w, room_.sun_at(*x));
  return ratio(mapped, smooth);
}

/// E(m) / E(n) of nine coefficients, times what of the half space of m lies above the surface, (1 + m.n) / 2 of its
/// light where that is even (a lune; Howell C-5 with an edge in common).
Rgb GlossyRays::relief_of_indirect(const ObjectPoint& point, const Surface& s) const {
  if (arriving_.empty() || s.normal == s.smooth)
    return Rgb(1.0f);
  const VirtualObjects::Part& part = room_.objects.objects().parts[point.part];
  const auto& t = part.mesh().triangles[point.triangle];
  const float weight[3] = {1.0f - point.u - point.v, point.u, point.v};
  Sh9Rgb light{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Sh9Rgb& vertex = arriving_[part.sender_of(t[k])];
    for (std::size_t i = 0; i < light.size(); ++i)
      light[i] += weight[k] * vertex[i];
  }
  const float above = 0.5f * (1.0f + glm::dot(s.normal, s.smooth));
  return above * ratio(irradiance(light, s.normal), irradiance(light, s.smooth));
}

/// direct x D + indirect x I = (direct + indirect) D - indirect (D - I): the first is all that was drawn.
void GlossyRays::shade_relief(const ObjectPoint& point, const Surface& s, GlossyLight& light) const {
  const Rgb direct = relief_of_direct(point, s), indirect = relief_of_indirect(point, s);
  light.occluded = indirect * light.occluded + (direct - indirect) * diffuse_of(indirect_, point, s);
  light.diffuse *= direct;
}

} // namespace daylit
