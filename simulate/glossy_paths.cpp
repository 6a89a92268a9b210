// Paths through surfaces that mirror, refract or send light. At each of them a path goes on either from the diffuse
// base or from all else, so that what came before it stays known: rules for light of diffuse surfaces hold from the
// first diffuse scattering on (path_tracer.h).

#include <algorithm>
#include <limits>
#include <numbers>

#include <glm/exponential.hpp>
#include <glm/geometric.hpp>

#include "simulate/glossy_surface.h"
#include "simulate/path_tracer.h"

namespace daylit {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::max();

} // namespace

/// The surface at a vertex. `base`: its diffuse part, which is what other diffuse surfaces know of it.
struct PathTracer::Met {
  GlossySurface surface;
  Vertex base;
  float offset = 0.0f;

  /// Where a ray starts, on the side it goes to.
  glm::vec3 origin(const glm::vec3& direction) const {
    return surface.same_side(direction) ? base.origin : base.position - offset * base.geometric_normal;
  }
  float glossy_density(const glm::vec3& direction) const {
    return (1.0f - base.share) * surface.glossy_density(direction);
  }
};

// Beer's law on the way inside; where colours are bent apart, one of them goes on with three times its weight.
PathTracer::Met PathTracer::met(const SurfacePoint& hit, const glm::vec3& direction, Rgb& throughput,
                                Path& path) const {
  SurfaceLook look = scene_->look(hit);
  SurfaceMaterial& m = look.material;
  if (!path.diffuse_before && !hit.outside && !m.thin)
    throughput *= glm::exp(-m.absorption_per_m * hit.distance);
  if (m.disperses()) {
    if (path.channel < 0) {
      path.channel = std::min(2, static_cast<int>(3.0f * path.point(kRoulette).y));
      Rgb kept(0.0f);
      kept[path.channel] = 3.0f * throughput[path.channel];
      throughput = kept;
    }
    m.ior = m.ior_of(path.channel);
  }
  const GlossySurface surface(look, hit, -direction);
  Vertex base = vertex_at(hit);
  base.normal = surface.normal();
  base.share = surface.base_share();
  return {surface, base, scene_->surface_offset()};
}

/// The base's part of what it is lit by from a direction. `open`: nothing at all is in the way.
Rgb PathTracer::open_base(const Met& m, const glm::vec3& direction, bool open, Path& path) const {
  if (glm::dot(m.base.normal, direction) <= 0.0f || glm::dot(m.base.geometric_normal, direction) <= 0.0f)
    return Rgb(0.0f);
  const Rgb base = m.surface.base(direction);
  if (open || base == Rgb(0.0f))
    return base;
  return base * scene_->transmittance(m.base.origin, direction, kInfinity, path.with_object, path.touched);
}

/// After a diffuse scattering transparent objects are passed, else they are met.
bool PathTracer::open_glossy(const Met& m, const glm::vec3& direction, Path& path) const {
  return !scene_->occluded(m.origin(direction), direction, kInfinity, path.with_object, path.touched);
}

// Balance heuristic, for the base and for all else apart.
Rgb PathTracer::glossy_sky(const Met& m, const glm::vec3& direction, Path& path) const {
  const glm::vec3 origin = m.origin(direction);
  const float spot = scene_->sky().spot_density(direction);
  const float light = scene_->apertures().density(origin, direction) + spot;
  const bool open = open_glossy(m, direction, path);
  Rgb base = open_base(m, direction, open, path);
  if (base != Rgb(0.0f)) // no density is above zero where there is none
    base /= light + m.base.share * std::max(0.0f, m.surface.base_density(direction));
  Rgb other(0.0f);
  if (open && !(path.diffuse_before && spot > 0.0f))
    if (other = m.surface.glossy(direction); other != Rgb(0.0f))
      other /= light + m.glossy_density(direction);
  if (base + other == Rgb(0.0f))
    return Rgb(0.0f);
  return (base + other) * scene_->sky().radiance(direction) * scene_->apertures().transmittance(origin, direction);
}

Rgb PathTracer::glossy_sun(const Met& m, const Vertex* previous, Path& path) const {
  const SunDisc& disc = *scene_->sky().sun();
  const glm::vec3 s = sun_direction(path.point(kSun));
  const float size = static_cast<float>(disc.solid_angle_sr());
  const bool open = open_glossy(m, s, path);
  Rgb sum = open_base(m, s, open, path);
  if (sum != Rgb(0.0f))
    sum *= size * bounce_weight(m.base, previous, s, path);
  if (open && !path.diffuse_before)
    sum += m.surface.glossy(s) / (1.0f / size + m.glossy_density(s));
  return sum == Rgb(0.0f) ? sum : sum * disc.radiance() * scene_->apertures().transmittance(m.origin(s), s);
}

Rgb PathTracer::glossy_direct(const Met& m, const Vertex* previous, Path& path) const {
  Rgb sum(0.0f);
  if (const auto sample = scene_->apertures().sample(m.base.origin, path.point(kOpening)))
    sum += glossy_sky(m, sample->direction, path);
  if (const auto sample = scene_->sky().sample_spot(path.point(kSpot)))
    sum += glossy_sky(m, sample->direction, path);
  if (scene_->sky().sun())
    sum += glossy_sun(m, previous, path);
  if (m.base.share > 0.0f)
    if (const BeamLight lit = sunlit_surface(m.base, path); lit.irradiance != Rgb(0.0f))
      sum += m.surface.base(lit.direction) / glm::dot(m.base.normal, lit.direction) * lit.irradiance *
             m.surface.material().occlusion;
  return sum;
}

/// What a path finds outside that goes on from all but the base.
Rgb PathTracer::escaped(const Met& m, const glm::vec3& direction, const Path& path) const {
  const glm::vec3 origin = m.origin(direction);
  const float own = m.glossy_density(direction), spot = scene_->sky().spot_density(direction);
  Rgb sum(0.0f);
  if (!(path.diffuse_before && spot > 0.0f))
    sum = scene_->sky().radiance(direction) * (own / (own + spot + scene_->apertures().density(origin, direction)));
  if (const auto& disc = scene_->sky().sun();
      disc && !path.diffuse_before && disc->contains(glm::normalize(glm::dvec3(direction))))
    sum += disc->radiance() * (own / (own + 1.0f / static_cast<float>(disc->solid_angle_sr())));
  return sum * scene_->apertures().transmittance(origin, direction);
}

/// Of the diffuse part; `from` with a positive cosine to y.normal.
Rgb PathTracer::base_brdf(const SurfacePoint& y, const glm::vec3& to, const glm::vec3& from) const {
  if (y.plain)
    return y.reflectance / std::numbers::pi_v<float>;
  return GlossySurface(scene_->look(y), y, to).base(from) / glm::dot(y.normal, from);
}

Rgb PathTracer::from_glossy(SurfacePoint hit, glm::vec3 direction, Rgb throughput, const Vertex* previous,
                            Path& path) const {
  Rgb sum(0.0f);
  Vertex before;
  for (;; ++path.depth) {
    const Met m = met(hit, direction, throughput, path);
    sum += throughput * (m.surface.material().emission + glossy_direct(m, previous, path));
    if (!survives(throughput, path))
      return sum;
    const glm::vec2 choice = path.point(kLobe);
    const bool from_base = choice.x < m.base.share;
    const auto next = from_base ? sample_cosine(m.base.normal, path.point(kBounce))
                                : m.surface.sample_glossy(path.point(kBounce), choice.y);
    if (!next || (from_base && glm::dot(*next, m.base.geometric_normal) <= 0.0f))
      return sum;
    const float density = from_base ? m.base.share * m.surface.base_density(*next) : m.glossy_density(*next);
    const Rgb value = from_base ? m.surface.base(*next) : m.surface.glossy(*next);
    if (!(density > 0.0f) || value == Rgb(0.0f))
      return sum;
    throughput *= value / density;
    path.diffuse_before |= from_base;
    const glm::vec3 origin = m.origin(*next);
    const auto found = path.diffuse_before
                           ? scene_->closest_opaque(origin, *next, path.with_object, path.touched, throughput)
                           : scene_->closest(m.base.origin, origin, *next, path.with_object, path.touched);
    if (!found)
      return sum + throughput *
                       (from_base ? scene_->sky().radiance(*next) * scene_->apertures().transmittance(origin, *next) *
                                        escape_weight(m.base, *next)
                                  : escaped(m, *next, path));
    if (from_base)
      throughput *= m.surface.material().occlusion;
    before = m.base;
    previous = from_base ? &before : nullptr;
    direction = *next;
    hit = *found;
    if (hit.plain) {
      ++path.depth;
      return sum + scattered(vertex_at(hit), throughput * hit.reflectance, previous, true, path);
    }
  }
}

} // namespace daylit
