#include "runtime/object/placed_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "runtime/object/ray_fan.h"
#include "scene/model/straight_light.h"

namespace daylit {

namespace {
constexpr float kInfinity = std::numeric_limits<float>::infinity();
} // namespace

/// world_from_object = T R s: its linear part is s R, and s the cube root of its determinant.
PlacedParts::PlacedParts(std::vector<PlacedPart> parts) {
  for (const PlacedPart& part : parts) {
    Caster c;
    c.part = part;
    const glm::dmat3 linear(part.world_from_object);
    c.scale = std::cbrt(std::fabs(glm::determinant(linear)));
    c.own_from_world = glm::transpose(linear / c.scale);
    c.position = glm::dvec3(part.world_from_object[3]);
    for (const glm::vec3& p : part.positions)
      c.box.include(glm::dvec3(p));
    double radius = 0.0;
    for (const glm::vec3& p : part.positions)
      radius = std::max(radius, glm::length(glm::dvec3(p) - c.box.centre()));
    if (!c.box.empty())
      c.sphere = {c.position + linear * c.box.centre(), c.scale * radius};
    const double least = std::max(c.sphere.radius, 1e-3);
    smallest_radius_ = casters_.empty() ? least : std::min(smallest_radius_, least);
    casters_.push_back(c);
  }
}

/// The first vertex of each place.
std::vector<std::uint32_t> PlacedParts::senders(std::size_t which) const {
  const PlacedPart& part = casters_[which].part;
  std::vector<std::uint32_t> sending;
  for (std::uint32_t v = 0; v < part.positions.size(); ++v)
    if (part.sender.empty() || sending.empty() || part.sender[v] > part.sender[sending.back()])
      sending.push_back(v);
  return sending;
}

glm::dvec3 PlacedParts::to_world(std::size_t which, const glm::dvec3& own) const {
  return glm::dvec3(casters_[which].part.world_from_object * glm::dvec4(own, 1.0));
}

/// R^T (x - t) / s.
glm::dvec3 PlacedParts::to_own(std::size_t which, const glm::dvec3& world) const {
  const Caster& c = casters_[which];
  return c.own_from_world * (world - c.position) / c.scale;
}

/// Distances of the part's own frame are s times smaller than the world's. The back is met when the ray runs along the
/// triangle's normal.
PartHit PlacedParts::part_hit(const Caster& c, const glm::vec3& own_direction, const RayHit& found) const {
  const auto& t = c.part.triangles[found.triangle];
  const glm::vec3 a = c.part.positions[t[0]];
  const glm::vec3 area = glm::cross(c.part.positions[t[1]] - a, c.part.positions[t[2]] - a);
  const auto light_of = [&](std::uint32_t v) {
    return c.part.sender.empty() ? static_cast<std::uint32_t>(c.part.first_vertex) + v : c.part.sender[v];
  };
  PartHit hit{
      {light_of(t[0]), light_of(t[1]), light_of(t[2])}, found.u,        found.v, glm::dot(area, own_direction) > 0.0f,
      static_cast<double>(found.distance) * c.scale,    glm::vec3(0.0f)};
  if (!c.part.mirror_normals.empty()) {
    const std::span<const glm::vec3> n = c.part.mirror_normals;
    glm::vec3 normal = glm::normalize((1.0f - found.u - found.v) * n[t[0]] + found.u * n[t[1]] + found.v * n[t[2]]);
    normal *= hit.back ? -1.0f : 1.0f;
    const glm::vec3 w = glm::normalize(own_direction);
    hit.mirrored =
        glm::transpose(glm::mat3(c.own_from_world)) * (w - 2.0f * std::min(glm::dot(w, normal), 0.0f) * normal);
  }
  return hit;
}

bool PlacedParts::cast(std::size_t which, const glm::dvec3& x, const glm::dvec3& w, PartHit& hit) const {
  const Caster& c = casters_[which];
  const RayScene& rays = *c.part.rays;
  const glm::vec3 direction(c.own_from_world * w);
  RayHit found;
  if (!rays.closest(rays.to_local(to_own(which, x)), direction, 0.0f, kInfinity, found))
    return false;
  hit = part_hit(c, direction, found);
  return true;
}

/// The part's sixteen rays at once, then for those that meet it the other parts one by one.
std::uint32_t PlacedParts::cast_first(std::size_t which, const glm::dvec3& x, std::span<const glm::dvec3> directions,
                                      std::span<PartHit> hits, std::size_t ignored) const {
  const Caster& c = casters_[which];
  const RayScene& rays = *c.part.rays;
  const glm::vec3 from = rays.to_local(to_own(which, x));
  const int count = static_cast<int>(directions.size());
  const RayPacket16 packet =
      ray_fan(from, directions.size(), [&](std::size_t k) { return glm::vec3(c.own_from_world * directions[k]); });
  RayHits16 found;
  std::uint32_t met = rays.closest16(packet, count, found);
  for (int k = 0; k < count; ++k) {
    if (!(met >> k & 1u))
      continue;
    hits[k] = part_hit(c, packet.direction(static_cast<std::size_t>(k)),
                       {found.triangle[k], found.distance[k], found.u[k], found.v[k]});
    for (std::size_t other = 0; other < casters_.size(); ++other)
      if (PartHit nearer; other != which && other != ignored && may_cover(casters_[other], x, directions[k]) &&
                          cast(other, x, directions[k], nearer) && nearer.distance < hits[k].distance)
        met &= ~(1u << k);
  }
  return met;
}

/// The ray meets the bounding sphere: |to|^2 - (to.w)^2 <= r^2 ahead of x, or x lies in it.
bool PlacedParts::may_cover(const Caster& c, const glm::dvec3& x, const glm::dvec3& w) {
  const glm::dvec3 to = c.sphere.centre - x;
  const double along = glm::dot(to, w), r2 = c.sphere.radius * c.sphere.radius, d2 = glm::dot(to, to);
  return d2 <= r2 || (along > 0.0 && d2 - along * along <= r2);
}

bool PlacedParts::hidden(const glm::dvec3& x, const glm::dvec3& w, double distance, std::size_t ignored) const {
  for (std::size_t part = 0; part < casters_.size(); ++part)
    if (PartHit hit; part != ignored && may_cover(casters_[part], x, w) && cast(part, x, w, hit) && !hit.back &&
                     hit.distance < distance)
      return true;
  return false;
}

double PlacedParts::distance(std::size_t which, const glm::dvec3& x, double within) const {
  const Caster& c = casters_[which];
  if (c.sphere.radius <= 0.0 || glm::length(x - c.sphere.centre) - c.sphere.radius >= within)
    return within;
  const RayScene& rays = *c.part.rays;
  return c.scale *
         static_cast<double>(rays.distance(rays.to_local(to_own(which, x)), static_cast<float>(within / c.scale)));
}

double PlacedParts::distance(const glm::dvec3& x, double within) const {
  for (std::size_t part = 0; part < casters_.size(); ++part)
    within = distance(part, x, within);
  return within;
}

bool PlacedParts::between(const glm::dvec3& a, const glm::dvec3& b) const {
  for (std::size_t part = 0; part < casters_.size(); ++part) {
    const Caster& c = casters_[part];
    if (c.sphere.radius <= 0.0 || glm::length(a - c.sphere.centre) > c.sphere.radius + glm::length(b - a))
      continue;
    const RayScene& rays = *c.part.rays;
    const glm::dvec3 from = to_own(part, a);
    if (rays.occluded(rays.to_local(from), glm::vec3(to_own(part, b) - from), 0.0f, 1.0f))
      return true;
  }
  return false;
}

Rgb PlacedParts::passed(const glm::dvec3& x, const glm::dvec3& w) const {
  Rgb left(occluded(x, {&w, 1}) ? 0.0f : 1.0f);
  for (std::size_t part = 0; part < casters_.size() && left != Rgb(0.0f); ++part)
    if (const Caster& c = casters_[part]; c.part.glass && may_cover(c, x, w))
      if (PartHit hit; cast(part, x, w, hit))
        left *= c.part.transmittance;
  return left;
}

/// Product over the faces on the way.
Rgb PlacedParts::passed_straight(std::size_t which, const glm::dvec3& x, const glm::dvec3& direction) const {
  constexpr int kMostFaces = 64;
  const Caster& c = casters_[which];
  const RayScene& rays = *c.part.rays;
  const glm::vec3 own = glm::vec3(c.own_from_world * direction);
  const float offset = 4.0f * rays.surface_offset();
  glm::vec3 from = rays.to_local(to_own(which, x)) - offset * own;
  Rgb left(1.0f);
  for (int face = 0; face < kMostFaces && left != Rgb(0.0f); ++face) {
    RayHit hit;
    if (!rays.closest(from, own, 0.0f, kInfinity, hit))
      return left;
    const auto& t = c.part.triangles[hit.triangle];
    const glm::vec3 a = c.part.positions[t[0]];
    const glm::vec3 area = glm::cross(c.part.positions[t[1]] - a, c.part.positions[t[2]] - a);
    left *= straight_transmittance(*c.part.glass, hit.triangle, hit.u, hit.v, glm::dot(glm::normalize(area), own),
                                   hit.distance * static_cast<float>(c.scale));
    from += (hit.distance + offset) * own;
  }
  return Rgb(0.0f);
}

std::uint32_t PlacedParts::occluded(const glm::dvec3& x, std::span<const glm::dvec3> directions,
                                    std::size_t ignored) const {
  std::uint32_t all = 0;
  for (std::size_t part = 0; part < casters_.size(); ++part)
    if (!casters_[part].part.glass && part != ignored)
      all |= covered(part, x, directions, ~all);
  return all;
}

/// Only rays that may meet the part's sphere are traced.
std::uint32_t PlacedParts::covered(std::size_t which, const glm::dvec3& x, std::span<const glm::dvec3> directions,
                                   std::uint32_t asked) const {
  const Caster& c = casters_[which];
  std::array<std::size_t, 16> source{};
  std::size_t count = 0;
  for (std::size_t k = 0; k < directions.size(); ++k)
    if ((asked >> k & 1u) && may_cover(c, x, directions[k]))
      source[count++] = k;
  if (count == 0)
    return 0;
  const RayScene& rays = *c.part.rays;
  const RayPacket16 packet = ray_fan(rays.to_local(to_own(which, x)), count, [&](std::size_t k) {
    return glm::vec3(c.own_from_world * directions[source[k]]);
  });
  const std::uint32_t met = rays.occluded16(packet, static_cast<int>(count));
  std::uint32_t all = 0;
  for (std::size_t k = 0; k < count; ++k)
    all |= (met >> k & 1u) << source[k];
  return all;
}

} // namespace daylit
