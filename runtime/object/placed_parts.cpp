#include "runtime/object/placed_parts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace daylit {

namespace {
constexpr float kInfinity = std::numeric_limits<float>::infinity();
}

PlacedParts::PlacedParts(std::vector<PlacedPart> parts) {
  for (const PlacedPart& part : parts) {
    Caster c;
    c.part = part;
    const glm::dmat3 linear(part.world_from_object);
    c.scale = std::cbrt(std::fabs(glm::determinant(linear)));
    c.own_from_world = glm::transpose(linear / c.scale);
    c.place = glm::dvec3(part.world_from_object[3]);
    for (const glm::vec3& p : part.positions)
      c.box.include(glm::dvec3(p));
    double radius = 0.0;
    for (const glm::vec3& p : part.positions)
      radius = std::max(radius, glm::length(glm::dvec3(p) - c.box.centre()));
    if (!c.box.empty())
      c.sphere = {c.place + linear * c.box.centre(), c.scale * radius};
    casters_.push_back(c);
  }
}

glm::dvec3 PlacedParts::to_world(std::size_t which, const glm::dvec3& own) const {
  return glm::dvec3(casters_[which].part.world_from_object * glm::dvec4(own, 1.0));
}

glm::dvec3 PlacedParts::to_own(std::size_t which, const glm::dvec3& world) const {
  const Caster& c = casters_[which];
  return c.own_from_world * (world - c.place) / c.scale;
}

bool PlacedParts::cast(std::size_t which, const glm::dvec3& x, const glm::dvec3& w, PartHit& hit) const {
  const Caster& c = casters_[which];
  const RayScene& rays = *c.part.rays;
  const glm::vec3 direction(c.own_from_world * w);
  RayHit found;
  if (!rays.closest(rays.to_local(to_own(which, x)), direction, 0.0f, kInfinity, found))
    return false;
  const auto& t = c.part.triangles[found.triangle];
  const glm::vec3 a = c.part.positions[t[0]];
  const glm::vec3 area = glm::cross(c.part.positions[t[1]] - a, c.part.positions[t[2]] - a);
  const auto first = static_cast<std::uint32_t>(c.part.first_vertex);
  hit = {{first + t[0], first + t[1], first + t[2]},
         found.u,
         found.v,
         glm::dot(area, direction) > 0.0f,
         static_cast<double>(found.distance) * c.scale};
  return true;
}

bool PlacedParts::cast_first(std::size_t which, const glm::dvec3& x, const glm::dvec3& w, PartHit& hit) const {
  if (!cast(which, x, w, hit))
    return false;
  for (std::size_t other = 0; other < casters_.size(); ++other)
    if (PartHit nearer; other != which && cast(other, x, w, nearer) && nearer.distance < hit.distance)
      return false;
  return true;
}

bool PlacedParts::covered(const glm::dvec3& x, const glm::dvec3& w) const {
  for (std::size_t k = 0; k < casters_.size(); ++k) {
    const Caster& c = casters_[k];
    const glm::dvec3 to = c.sphere.centre - x;
    const double along = glm::dot(to, w), r2 = c.sphere.radius * c.sphere.radius, d2 = glm::dot(to, to);
    if (d2 > r2 && (along <= 0.0 || d2 - along * along > r2))
      continue;
    const RayScene& rays = *c.part.rays;
    if (rays.occluded(rays.to_local(to_own(k, x)), glm::vec3(c.own_from_world * w), 0.0f, kInfinity))
      return true;
  }
  return false;
}

} // namespace daylit
