#include "simulate/path_tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>

namespace daylit {

namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kInfinity = std::numeric_limits<float>::max();

// The first vertices of a path look for sunlit surfaces; beyond, their light is a small smooth part of the sum.
constexpr std::uint32_t kBeamDepth = 4;
// Every path ends: from here on it survives with at most kMaxSurvival, also in a closed room of albedo 1. Ending paths
// as soon as their weight falls costs more variance than it saves time; twice the weight was best in furnished rooms.
constexpr std::uint32_t kRouletteDepth = 4;
constexpr float kMaxSurvival = 0.95f, kSurvivalPerWeight = 2.0f;

float largest(const Rgb& c) { return std::max({c.r, c.g, c.b}); }

/// Orthonormal tangents of a unit vector (Duff et al. 2017, eq. in listing 3).
void tangents(const glm::vec3& n, glm::vec3& t, glm::vec3& b) {
  const float sign = std::copysign(1.0f, n.z);
  const float a = -1.0f / (sign + n.z), c = n.x * n.y * a;
  t = {1.0f + sign * n.x * n.x * a, sign * c, -sign * n.x};
  b = {c, sign + n.y * n.y * a, -n.y};
}

/// Concentric map of the unit square to the unit disc (Shirley & Chiu 1997).
glm::vec2 square_to_disc(const glm::vec2& u) {
  const glm::vec2 s = 2.0f * u - 1.0f;
  if (s.x == 0.0f && s.y == 0.0f)
    return s;
  const bool wide = std::abs(s.x) > std::abs(s.y);
  const float r = wide ? s.x : s.y;
  const float angle = wide ? kPi / 4.0f * (s.y / s.x) : kPi / 2.0f - kPi / 4.0f * (s.x / s.y);
  return {r * std::cos(angle), r * std::sin(angle)};
}

} // namespace

glm::vec3 sample_cosine(const glm::vec3& normal, const glm::vec2& u) {
  const glm::vec2 d = square_to_disc(u);
  glm::vec3 t, b;
  tangents(normal, t, b);
  return glm::normalize(d.x * t + d.y * b + std::sqrt(std::max(1e-12f, 1.0f - glm::dot(d, d))) * normal);
}

PathTracer::Vertex PathTracer::vertex_at(const SurfacePoint& p) const {
  return {p.position, p.geometric_normal, p.normal, p.position + scene_->surface_offset() * p.geometric_normal, 1.0f};
}

glm::vec3 PathTracer::sun_direction(const glm::vec2& u) const {
  const SunDisc& sun = *scene_->sky().sun();
  // Equal-area disc to cap: 2 sin(theta / 2) is the chord, proportional to the disc radius.
  const glm::vec2 d = square_to_disc(u);
  const float half = std::sin(0.5f * static_cast<float>(sun.angular_radius));
  const float chord2 = glm::dot(d, d) * half * half;
  const float scale = 2.0f * half * std::sqrt(1.0f - chord2);
  const glm::vec3 axis(sun.direction);
  glm::vec3 t, b;
  tangents(axis, t, b);
  return glm::normalize(scale * (d.x * t + d.y * b) + (1.0f - 2.0f * chord2) * axis);
}

/// Cosine at the surface towards a direction in front of it, times what comes through from there; 0 for any other.
Rgb PathTracer::open_cosine(const Vertex& v, const glm::vec3& direction, Path& path) const {
  const float cosine = glm::dot(v.normal, direction);
  if (cosine <= 0.0f || glm::dot(v.geometric_normal, direction) <= 0.0f)
    return Rgb(0.0f);
  return cosine * scene_->transmittance(v.origin, direction, kInfinity, path.with_object, path.touched);
}

Rgb PathTracer::sky_from_openings(const Vertex& v, const glm::vec2& u, Path& path) const {
  const auto sample = scene_->apertures().sample(v.origin, u);
  if (!sample)
    return Rgb(0.0f);
  const Rgb open = open_cosine(v, sample->direction, path);
  if (open == Rgb(0.0f))
    return Rgb(0.0f);
  const float cosine = glm::dot(v.normal, sample->direction);
  const float all = sample->density + scene_->sky().spot_density(sample->direction) + cosine / kPi;
  return scene_->sky().radiance(sample->direction) * sample->transmittance * (open / all);
}

Rgb PathTracer::sky_from_spots(const Vertex& v, const glm::vec2& u, Path& path) const {
  const auto sample = scene_->sky().sample_spot(u);
  if (!sample)
    return Rgb(0.0f);
  const Rgb open = open_cosine(v, sample->direction, path);
  if (open == Rgb(0.0f))
    return Rgb(0.0f);
  const float cosine = glm::dot(v.normal, sample->direction);
  const float all = sample->density + scene_->apertures().density(v.origin, sample->direction) + cosine / kPi;
  return scene_->sky().radiance(sample->direction) * scene_->apertures().transmittance(v.origin, sample->direction) *
         (open / all);
}

float PathTracer::escape_weight(const Vertex& v, const glm::vec3& direction) const {
  const float own = v.share * glm::dot(v.normal, direction) / kPi;
  return own / (own + scene_->apertures().density(v.origin, direction) + scene_->sky().spot_density(direction));
}

/// Of the sun's light at v when the vertex before it looks for sunlit surfaces too.
float PathTracer::bounce_weight(const Vertex& v, const Vertex* previous, const glm::vec3& to_sun,
                                const Path& path) const {
  if (!previous || path.depth - path.first > kBeamDepth)
    return 1.0f;
  const glm::vec3 to = v.position - previous->position;
  const float r2 = glm::dot(to, to), r = std::sqrt(r2);
  const float bounce = previous->share * std::max(0.0f, glm::dot(previous->normal, to)) *
                       std::abs(glm::dot(v.geometric_normal, to)) / (kPi * r2 * r2);
  const float beam = glm::dot(v.geometric_normal, to_sun) * scene_->apertures().beam_density(v.origin, to_sun);
  return r > 0.0f && bounce + beam > 0.0f ? bounce / (bounce + beam) : 1.0f;
}

Rgb PathTracer::sun(const Vertex& v, const glm::vec2& u, const Vertex* previous, Path& path) const {
  const glm::vec3 s = sun_direction(u);
  const Rgb open = open_cosine(v, s, path);
  if (open == Rgb(0.0f))
    return Rgb(0.0f);
  const SunDisc& disc = *scene_->sky().sun();
  return disc.radiance() * static_cast<float>(disc.solid_angle_sr()) * scene_->apertures().transmittance(v.origin, s) *
         (open * bounce_weight(v, previous, s, path));
}

PathTracer::BeamLight PathTracer::sunlit_surface(const Vertex& v, Path& path) const {
  if (!scene_->sky().sun() || path.depth - path.first >= kBeamDepth)
    return {};
  const glm::vec3 s = sun_direction(path.point(kBeamSun));
  const auto entry = scene_->apertures().sample_beam(s, path.point(kBeamPoint));
  if (!entry)
    return {};
  Rgb through = scene_->transmittance(*entry, s, kInfinity, path.with_object, path.touched);
  if (through == Rgb(0.0f))
    return {};
  const auto lit = scene_->closest_opaque(*entry, -s, path.with_object, path.touched, through);
  if (!lit)
    return {};
  const Vertex y = vertex_at(*lit);
  const glm::vec3 to = y.origin - v.origin;
  const float r2 = glm::dot(to, to), r = std::sqrt(r2);
  if (!(r > scene_->surface_offset()))
    return {};
  const glm::vec3 w = to / r;
  const float cos_v = glm::dot(v.normal, w), cos_y = -glm::dot(y.geometric_normal, w),
              cos_y_shading = -glm::dot(y.normal, w), sun_geometric = glm::dot(y.geometric_normal, s),
              sun_shading = glm::dot(y.normal, s);
  if (cos_v <= 0.0f || glm::dot(v.geometric_normal, w) <= 0.0f || cos_y <= 0.0f || cos_y_shading <= 0.0f ||
      sun_geometric <= 0.0f || sun_shading <= 0.0f)
    return {};
  const float beam = sun_geometric * scene_->apertures().beam_density(y.origin, s);
  if (beam <= 0.0f)
    return {};
  through *= scene_->transmittance(v.origin, w, r, path.with_object, path.touched);
  if (through == Rgb(0.0f))
    return {};
  const float bounce = v.share * cos_v * cos_y / (kPi * r2);
  const SunDisc& disc = *scene_->sky().sun();
  const Rgb irradiance = disc.radiance() * static_cast<float>(disc.solid_angle_sr()) *
                         scene_->apertures().transmittance(y.origin, s) * sun_shading;
  return {base_brdf(*lit, -w, s) * irradiance * (cos_v * cos_y / r2 / (beam + bounce)) * through, w};
}

Rgb PathTracer::direct(const Vertex& v, const Vertex* previous, Path& path) const {
  Rgb sum = sky_from_openings(v, path.point(kOpening), path);
  if (scene_->sky().has_spots())
    sum += sky_from_spots(v, path.point(kSpot), path);
  if (scene_->sky().sun())
    sum += sun(v, path.point(kSun), previous, path);
  return sum;
}

/// Russian roulette.
bool PathTracer::survives(Rgb& throughput, const Path& path) const {
  if (path.depth - path.first < kRouletteDepth)
    return true;
  const float survival = std::min(kMaxSurvival, kSurvivalPerWeight * largest(throughput) / path.full);
  if (path.point(kRoulette).x >= survival)
    return false;
  throughput /= survival;
  return true;
}

Rgb PathTracer::scattered(Vertex v, Rgb throughput, const Vertex* previous, bool direct_at_first, Path& path) const {
  Rgb sum(0.0f);
  Vertex before;
  path.diffuse_before = true;
  for (bool count_direct = direct_at_first;; ++path.depth, count_direct = true) {
    if (count_direct)
      sum += throughput / kPi * direct(v, previous, path);
    sum += throughput / kPi * sunlit_surface(v, path).irradiance;
    if (!survives(throughput, path))
      return sum;
    const glm::vec3 direction = sample_cosine(v.normal, path.point(kBounce));
    if (glm::dot(direction, v.geometric_normal) <= 0.0f)
      return sum;
    const auto hit = scene_->closest_opaque(v.origin, direction, path.with_object, path.touched, throughput);
    if (!hit) {
      if (count_direct)
        sum += throughput * scene_->sky().radiance(direction) * scene_->apertures().transmittance(v.origin, direction) *
               escape_weight(v, direction);
      return sum;
    }
    before = v;
    previous = &before;
    if (!hit->plain) {
      ++path.depth;
      return sum + from_glossy(*hit, direction, throughput, previous, path);
    }
    throughput *= hit->reflectance;
    if (largest(throughput) <= 0.0f)
      return sum;
    v = vertex_at(*hit);
  }
}

/// What a camera's ray brings back from the first surface that it meets.
Rgb PathTracer::first_hit(const glm::vec3& direction, const SurfacePoint& hit, Path& path) const {
  path.first = path.depth = 1;
  path.full = hit.plain ? std::max(largest(hit.reflectance), 1e-30f) : 1.0f;
  return hit.plain ? scattered(vertex_at(hit), hit.reflectance, nullptr, true, path)
                   : from_glossy(hit, direction, Rgb(1.0f), nullptr, path);
}

PathResult PathTracer::radiance(const glm::vec3& origin, const glm::vec3& direction, const SampleStream& samples,
                                bool with_object) const {
  Path path{samples, with_object};
  const auto hit = scene_->closest(origin, direction, with_object, path.touched);
  if (hit) {
    const Rgb value = first_hit(direction, *hit, path);
    return {value, path.touched, hit->on_object};
  }
  Rgb value = scene_->sky().radiance(direction);
  if (const auto& disc = scene_->sky().sun(); disc && disc->contains(glm::normalize(glm::dvec3(direction))))
    value += disc->radiance();
  return {value * scene_->apertures().transmittance(origin, direction), path.touched, false};
}

PathResult PathTracer::indirect_radiance(const glm::vec3& origin, const glm::vec3& direction,
                                         const SampleStream& samples, bool with_object) const {
  Path path{samples, with_object};
  const auto hit = scene_->closest(origin, direction, with_object, path.touched);
  if (!hit)
    return {Rgb(0.0f), path.touched, false};
  const Rgb value = first_hit(direction, *hit, path);
  return {value, path.touched, hit->on_object};
}

PathResult PathTracer::indirect_irradiance(const glm::vec3& point, const glm::vec3& normal, const SampleStream& samples,
                                           bool with_object) const {
  Path path{samples, with_object};
  path.full = kPi;
  const Rgb value = scattered({point, normal, normal, point, 1.0f}, Rgb(kPi), nullptr, false, path);
  return {value, path.touched, false};
}

PathResult PathTracer::direct_irradiance(const glm::vec3& point, const glm::vec3& normal, const SampleStream& samples,
                                         bool with_object) const {
  Path path{samples, with_object};
  const Vertex v{point, normal, normal, point, 1.0f};
  Rgb value = direct(v, nullptr, path), through(1.0f);
  const glm::vec3 direction = sample_cosine(normal, path.point(kBounce));
  if (!scene_->closest_opaque(point, direction, with_object, path.touched, through))
    value += kPi * through * scene_->sky().radiance(direction) * scene_->apertures().transmittance(point, direction) *
             escape_weight(v, direction);
  return {value, path.touched, false};
}

} // namespace daylit
