// What GlossyRays sees of sun and sky without rays of its own: highlights.

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "runtime/reflect/glossy_surface.h"
#include "scene/material/fresnel.h"

namespace daylit {

namespace {

constexpr float kLeastSharing = 0.02f;     // slope from which a lobe's tails are wide enough to meet windows by chance
constexpr float kLeastSkyBehind = 0.1f;    // slope from which a lobe is wider than the lights lie apart
constexpr std::size_t kPatternsBehind = 4; // of the lights, of which a ray takes one
constexpr float kFaintest = 1e-4f;         // of a light's irradiance

/// As seen from a normal that is turned by small angles.
glm::vec3 tilted(const glm::vec3& w, const glm::vec2& turn) {
  return glm::normalize(glm::vec3(w.x - turn.x * w.z, w.y - turn.y * w.z, w.z + turn.x * w.x + turn.y * w.y));
}

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

/// Turn of the normal for a step on the surface, both along tangent and bitangent, per metre: with the edges E of the
/// triangle and the differences N of the normals along them, N E^-1.
glm::mat2 GlossyRays::curvature(const ObjectPoint& point, const Surface& s) const {
  const ObjectMesh& mesh = room_.objects.objects().parts[point.part].mesh();
  const glm::mat3 own_from_world = glm::transpose(room_.objects.rotation(point.part));
  const glm::vec3 u = own_from_world * s.tangent, v = own_from_world * s.bitangent;
  const auto& t = mesh.triangles[point.triangle];
  glm::mat2 edges, turns;
  for (int k = 0; k < 2; ++k) {
    const glm::vec3 edge = mesh.positions[t[static_cast<std::size_t>(k) + 1]] - mesh.positions[t[0]],
                    turn = mesh.normals[t[static_cast<std::size_t>(k) + 1]] - mesh.normals[t[0]];
    edges[k] = glm::vec2(glm::dot(edge, u), glm::dot(edge, v));
    turns[k] = glm::vec2(glm::dot(turn, u), glm::dot(turn, v));
  }
  if (std::fabs(glm::determinant(edges)) <= 1e-6f * glm::length(edges[0]) * glm::length(edges[1]))
    return glm::mat2(0.0f);
  return turns * glm::inverse(edges) / static_cast<float>(room_.objects.scale(point.part));
}

/// Of a square pixel: what is seen at an angle is longer by 1 / cos along the view.
NormalSpread GlossyRays::spread_seen(const ObjectPoint& point, double width_m, const Surface& s) const {
  constexpr float kMost_rad = 0.5f, kLeastCosine = 0.05f;
  const glm::mat2 turn_per_pixel = static_cast<float>(width_m) * curvature(point, s);
  const glm::vec2 view(s.out.x, s.out.y), along = glm::dot(view, view) > 0.0f ? glm::normalize(view) : glm::vec2(1, 0);
  NormalSpread spread(0.0f);
  for (const glm::vec2& side : {glm::vec2(-along.y, along.x), along / std::max(std::fabs(s.out.z), kLeastCosine)}) {
    glm::vec2 turn = turn_per_pixel * side;
    turn *= std::min(1.0f, kMost_rad / std::max(glm::length(turn), 1e-9f));
    spread += glm::outerProduct(turn, turn);
  }
  return spread;
}

/// Of lobes narrower than a pixel: F P(h) / (4 out . h), with the normals of the pixel spread around its own by
/// P = 3 / (pi sqrt(det R)) (1 - h^T R^-1 h)^2. R: their spread in the pixel, and half the sun's radius, squared.
Rgb GlossyRays::sharp_glint(const Surface& s, const glm::vec3& in, const NormalSpread& spread) const {
  const glm::vec3 h = glm::normalize(s.out + in);
  const NormalSpread r = spread + even_spread(0.5f * kSunRadius);
  const glm::vec2 xy(h.x, h.y);
  const float inside = 1.0f - glm::dot(xy, glm::inverse(r) * xy);
  if (inside <= 0.0f)
    return Rgb(0.0f);
  const auto lobes = s.bsdf.sample_lobes(s.out, glm::vec2(0.5f));
  const Rgb coat = s.has_sharp_coat() && lobes[0] ? lobes[0]->weight : Rgb(0.0f),
            facets = s.is_sharp() && lobes[1] ? lobes[1]->weight : Rgb(0.0f);
  return (coat + facets) * (3.0f * std::numbers::inv_pi_v<float> / std::sqrt(glm::determinant(r)) * inside * inside /
                            (4.0f * glm::dot(s.out, h)));
}

/// Mean of f cos over the normals of a pixel, at the middles of up to 6 x 6 parts of it along the axes of S: no wider
/// than the lobe's slope, since what spreads the facets lifts the tails of the lobe too, as long as the sun is mirrored
/// nearby. The facets of a part are spread by its turn (alpha^2 = turn^2 / pi: in the middle as bright as the mean over
/// a square of that side; Kaplanyan et al. 2016) and by the disc (a quarter of the variance of its radius, for half
/// vectors): slopes diag(alpha_u^2, alpha_v^2) + S_part / pi + r^2 / 8.
Rgb GlossyRays::wide_glint(const Surface& s, const glm::vec3& in, const NormalSpread& spread) {
  const Axes pixel(spread);
  const glm::vec3 h = glm::normalize(s.out + in);
  SurfaceMaterial m = s.material;
  const bool nearby = std::hypot(h.x, h.y) < pixel.length.x + 4.0f * std::max(m.alpha_u, m.alpha_v);
  const glm::vec2 lobes = glm::vec2(s.alpha()),
                  parts = nearby ? glm::clamp(glm::ceil(pixel.length / lobes), 1.0f, 6.0f) : glm::vec2(1.0f),
                  side = nearby ? pixel.length / parts : glm::vec2(0.0f);
  const Axes slopes(glm::mat2(m.alpha_u * m.alpha_u, 0.0f, 0.0f, m.alpha_v * m.alpha_v) +
                    std::numbers::inv_pi_v<float> * pixel.matrix(side) + glm::mat2(kSunRadius * kSunRadius / 8.0f));
  m.alpha_u = slopes.length.x;
  m.alpha_v = slopes.length.y;
  m.clearcoat_alpha = std::sqrt(m.clearcoat_alpha * m.clearcoat_alpha + kSunRadius * kSunRadius / 8.0f +
                                0.5f * std::numbers::inv_pi_v<float> * glm::dot(side, side));
  if (s.has_sharp_coat())
    m.clearcoat = 0.0f;
  const Bsdf bsdf(m);
  Rgb sum(0.0f);
  for (float j = 0.5f; j < parts.y; ++j)
    for (float i = 0.5f; i < parts.x; ++i) {
      const glm::vec2 turn = pixel.to_plane(side * (glm::vec2(i, j) - 0.5f * parts));
      const glm::vec3 there = slopes.turned(tilted(s.out, turn)), light = slopes.turned(tilted(in, turn));
      sum += std::max(light.z, 0.0f) * bsdf.glossy(there, light);
    }
  const auto passes = [&](float z) { return 1.0f - s.material.clearcoat * fresnel_dielectric(z, Bsdf::kCoatIor); };
  return (s.has_sharp_coat() ? passes(s.out.z) * passes(in.z) : 1.0f) / (parts.x * parts.y) * sum;
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

/// f(out, sun) cos E. A sharp lobe whose pixel is narrower than the disc meets it with its ray.
Rgb GlossyRays::glint(const ObjectPoint& point, const Surface& s, const NormalSpread& spread, double turn) const {
  if (!room_.sun || (s.is_sharp() && meets_disc(Axes(spread).length.x)))
    return Rgb(0.0f);
  const glm::vec3 to_sun(room_.sun->direction), in = s.to_local(to_sun);
  const auto x = lit_from(point, s, to_sun);
  if (!x)
    return Rgb(0.0f);
  Rgb f(0.0f);
  if (s.is_sharp() || s.has_sharp_coat())
    f += sharp_glint(s, in, spread);
  if (!s.is_sharp())
    f += wide_glint(s, in, spread);
  if (largest(f) > kFaintest && is_behind_rough_glass(*x, to_sun))
    f = Rgb(0.0f);
  return largest(glm::abs(f)) > kFaintest ? f * room_.disc_at(*x, turn) : Rgb(0.0f);
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
    if (samples > 0.0f && largest(weight) * times > kFaintest) {
      const float lights = light_density(direction, s.alpha(), step);
      for (const std::optional<BsdfSample>& lobe : s.bsdf.mirroring_lobes(s.out, in))
        if (lobe)
          weight -= lobe_part(samples * lobe->density, lights) * lobe->density * lobe->weight;
    }
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

/// What the far side lets in of the sky, by a quarter of the lights. Its lobe stands for what the ray's lobe, `width`
/// wide, sees of that side, and is as much wider: without it single lights shine in single pixels (Kaplanyan and
/// Dachsbacher 2013).
Rgb GlossyRays::sky_behind(const ObjectPoint& point, const Surface& s, float width_rad, std::size_t pattern) const {
  Surface wide = s;
  wide.material.alpha_u = std::hypot(s.material.alpha_u, width_rad);
  wide.material.alpha_v = std::hypot(s.material.alpha_v, width_rad);
  wide.bsdf = Bsdf(wide.material);
  return sky_highlight(point, wide, 0.0f, pattern % kPatternsBehind, kPatternsBehind);
}

} // namespace daylit
