// What GlossyRays sees of sun and sky without rays of its own: highlights.

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/reflect/glossy_surface.h"
#include "scene/material/fresnel.h"

namespace daylit {

namespace {

constexpr float kLeastSharing = 0.02f;  // slope from which a lobe's tails are wide enough to meet windows by chance
constexpr float kLeastSkyBehind = 0.1f; // slope from which a lobe is wider than the lights lie apart
constexpr float kFaintest = 1e-4f;      // of a light's irradiance

} // namespace

/// Just above the surface, where light from that direction meets its outside.
std::optional<glm::dvec3> GlossyRays::lit_from(const ObjectPoint& point, const Surface& s,
                                               const glm::vec3& direction) const {
  const float side = glm::dot(s.normal, point.face_normal) < 0.0f ? -1.0f : 1.0f;
  if (glm::dot(direction, s.normal) <= 0.0f || side * glm::dot(direction, point.face_normal) <= 0.0f)
    return std::nullopt;
  return point.position +
         room_.objects.offset_m(point.part) * static_cast<double>(side) * glm::dvec3(point.face_normal);
}

/// How far the normal turns within so many metres of the surface, radians: along the edge where it turns most.
float GlossyRays::turn_in(const ObjectPoint& point, double width_m) const {
  const ObjectMesh& mesh = room_.objects.objects().parts[point.part].mesh();
  const auto& t = mesh.triangles[point.triangle];
  float most = 0.0f;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t a = t[k], b = t[(k + 1) % 3];
    const float length = glm::distance(mesh.positions[a], mesh.positions[b]);
    if (length > 0.0f)
      most = std::max(most, glm::distance(mesh.normals[a], mesh.normals[b]) / length);
  }
  return std::min(most * static_cast<float>(width_m / room_.objects.scale(point.part)), 0.5f);
}

/// Of lobes narrower than a pixel: F P(h) / (4 out . h), with the normals of the pixel spread around its own by
/// P = 3 / (pi r^2) (1 - (angle / r)^2)^2. r: their turn in the pixel, and half the sun's radius.
Rgb GlossyRays::sharp_glint(const Surface& s, const glm::vec3& in, float turn_rad) const {
  const glm::vec3 h = glm::normalize(s.out + in);
  const float radius2 = turn_rad * turn_rad + 0.25f * kSunRadius * kSunRadius,
              inside = 1.0f - (h.x * h.x + h.y * h.y) / radius2;
  if (inside <= 0.0f)
    return Rgb(0.0f);
  const auto lobes = s.bsdf.sample_lobes(s.out, glm::vec2(0.5f));
  const Rgb coat = s.has_sharp_coat() && lobes[0] ? lobes[0]->weight : Rgb(0.0f),
            facets = s.is_sharp() && lobes[1] ? lobes[1]->weight : Rgb(0.0f);
  return (coat + facets) *
         (3.0f * std::numbers::inv_pi_v<float> / radius2 * inside * inside / (4.0f * glm::dot(s.out, h)));
}

/// Where rays that go through it find its own highlight, which has all of the sun.
bool GlossyRays::is_behind_rough_glass(const glm::dvec3& x, const glm::vec3& direction) const {
  const WorldRay ray{x, direction};
  const auto point = room_.objects.closest(ray, std::numeric_limits<double>::infinity());
  if (!point)
    return false;
  const Surface s = surface(ray, *point, 0.0, kAllColours);
  return s.material.transmission > 0.0f && !s.is_sharp();
}

/// f(out, sun) cos E. Facets are spread by the turn of the normal in a pixel (alpha^2 = turn^2 / pi: in the middle as
/// bright as the mean over a square of that side; Kaplanyan et al. 2016) and by the disc (a quarter of the variance of
/// its radius, for half vectors). A sharp lobe whose pixel is narrower than the disc meets it with its ray.
Rgb GlossyRays::glint(const ObjectPoint& point, const Surface& s, float turn_rad, double turn) const {
  if (!room_.sun || (s.is_sharp() && meets_disc(turn_rad)))
    return Rgb(0.0f);
  const glm::vec3 to_sun(room_.sun->direction), in = s.to_local(to_sun);
  const auto x = lit_from(point, s, to_sun);
  if (!x)
    return Rgb(0.0f);
  Rgb f(0.0f);
  if (s.is_sharp() || s.has_sharp_coat())
    f += sharp_glint(s, in, turn_rad);
  if (!s.is_sharp()) {
    const float spread2 = turn_rad * turn_rad * std::numbers::inv_pi_v<float> + kSunRadius * kSunRadius / 8.0f;
    const auto spread = [&](float alpha) { return std::sqrt(alpha * alpha + spread2); };
    SurfaceMaterial m = s.material;
    m.alpha_u = spread(m.alpha_u);
    m.alpha_v = spread(m.alpha_v);
    m.clearcoat_alpha = spread(m.clearcoat_alpha);
    const auto passes = [&](float cosine) { return 1.0f - m.clearcoat * fresnel_dielectric(cosine, Bsdf::kCoatIor); };
    const float under_coat = s.has_sharp_coat() ? passes(s.out.z) * passes(in.z) : 1.0f;
    if (s.has_sharp_coat())
      m.clearcoat = 0.0f;
    f += under_coat * in.z * Bsdf(m).glossy(s.out, in);
  }
  if (largest(f) <= kFaintest || is_behind_rough_glass(*x, to_sun))
    return Rgb(0.0f);
  return f * room_.disc_at(*x, turn);
}

/// The tails of a lobe are wide and seldom sampled: there a window is found by chance, and is much brighter than what
/// is around it. What mirrors finds the sky by the frame's lights as well.
bool GlossyRays::shares_sky(const Surface& s) const { return !sky_.empty() && s.alpha() >= kLeastSharing; }

/// Of every `step`-th of the frame's lights, which lie as dense as the sky is bright; per sr.
float GlossyRays::light_density(const glm::vec3& direction, float width_rad, std::size_t step) const {
  const float count = static_cast<float>(sky_.size()) / static_cast<float>(step);
  return count * luminance(room_.sky(direction, width_rad)) / sky_luminance_;
}

/// Power heuristic (Veach & Guibas 1995): a^2 / (a^2 + b^2), a: density of all samples of the lobe, b: of the lights.
float GlossyRays::lobe_part(float lobe_density, float light_density) {
  const float a2 = lobe_density * lobe_density, b2 = light_density * light_density;
  return a2 / std::max(a2 + b2, 1e-30f);
}

/// sum f cos E T V of every `step`-th light, times `step`, less what `samples` of the lobes find of it. Samples
/// without a density, of light that facets reflect more than once, find none. V is 0 behind any object: rays that go
/// on through glass find the sky there.
Rgb GlossyRays::sky_highlight(const ObjectPoint& point, const Surface& s, float samples, std::size_t first,
                              std::size_t step) const {
  const auto times = static_cast<float>(step);
  Rgb sum(0.0f);
  for (std::size_t j = first; j < sky_.size(); j += step) {
    const glm::vec3 direction(sky_[j].direction), in = s.to_local(direction);
    const auto x = lit_from(point, s, direction);
    if (!x)
      continue;
    Rgb weight = in.z * s.bsdf.glossy(s.out, in);
    const float lights = light_density(direction, s.alpha(), step);
    for (const std::optional<BsdfSample>& lobe : s.bsdf.mirroring_lobes(s.out, in))
      if (lobe)
        weight -= lobe_part(samples * lobe->density, lights) * lobe->density * lobe->weight;
    if (largest(weight) * times > kFaintest)
      sum +=
          times * glm::max(weight, Rgb(0.0f)) * sky_[j].irradiance * room_.arrives_freely_from(*x, sky_[j].direction);
  }
  return sum;
}

/// From inside of glass its far side is a lobe that seldom finds a window, too.
bool GlossyRays::finds_sky_behind(bool inside, const Surface& s) const {
  return inside && !sky_.empty() && s.alpha() >= kLeastSkyBehind;
}

} // namespace daylit
