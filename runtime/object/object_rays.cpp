#include "runtime/object/object_rays.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "scene/core/orthonormal.h"
#include "scene/model/straight_light.h"

namespace daylit {

namespace {
constexpr int kMostFaces = 16; // of glass on one straight way; more let nothing through that could be seen
}

ObjectRays::ObjectRays(const VirtualObjects& objects) : objects_(objects) {
  for (std::size_t k = 0; k < objects.parts.size(); ++k) {
    const VirtualObjects::Part& part = objects.parts[k];
    Placed p;
    p.own_from_world = glm::inverse(part.world_from_object);
    const glm::dmat3 linear(part.world_from_object);
    p.scale = std::cbrt(std::fabs(glm::determinant(linear)));
    p.rotation = glm::mat3(linear / p.scale);
    p.offset_m = 4.0 * static_cast<double>(part.rays().surface_offset()) * p.scale;
    p.sphere = objects.bounds(k);
    placed_.push_back(p);
  }
}

/// The ray passes the sphere around the part within `most_m`.
bool ObjectRays::may_meet(const Placed& part, const WorldRay& ray, double most_m) const {
  const glm::dvec3 d = part.sphere.centre - ray.origin;
  const double along = glm::dot(d, glm::dvec3(ray.direction)), r2 = part.sphere.radius * part.sphere.radius;
  const double away2 = glm::dot(d, d);
  return away2 <= r2 || (along > 0.0 && away2 - along * along <= r2 && along - part.sphere.radius <= most_m);
}

std::optional<ObjectPoint> ObjectRays::closest(const WorldRay& ray, double most_m) const {
  return closest(ray, most_m, all());
}
Rgb ObjectRays::transmittance(const WorldRay& ray, double most_m) const { return transmittance(ray, most_m, all()); }

/// In the frame of each part, whose directions are not unit vectors: distances along the ray are those of the world.
std::optional<ObjectPoint> ObjectRays::closest(const WorldRay& ray, double most_m, Parts parts) const {
  std::optional<ObjectPoint> first;
  float nearest = static_cast<float>(std::min(most_m, 1e9));
  for (std::size_t k = parts.first; k < parts.last; ++k) {
    const Placed& p = placed_[k];
    if (!may_meet(p, ray, static_cast<double>(nearest)))
      continue;
    const VirtualObjects::Part& part = objects_.parts[k];
    RayHit hit;
    if (!part.rays().closest(part.rays().to_local(glm::dvec3(p.own_from_world * glm::dvec4(ray.origin, 1.0))),
                             glm::vec3(glm::dmat3(p.own_from_world) * glm::dvec3(ray.direction)), 0.0f, nearest, hit))
      continue;
    nearest = hit.distance;
    first = ObjectPoint{k, hit.triangle, hit.u, hit.v, static_cast<double>(hit.distance), {}, {}};
  }
  if (first)
    complete(ray, *first);
  return first;
}

/// Where it is and how it lies.
void ObjectRays::complete(const WorldRay& ray, ObjectPoint& point) const {
  const ObjectMesh& mesh = objects_.parts[point.part].mesh();
  const auto& t = mesh.triangles[point.triangle];
  const glm::vec3 a = mesh.positions[t[0]];
  point.position = ray.origin + point.distance * glm::dvec3(ray.direction);
  point.face_normal =
      glm::normalize(placed_[point.part].rotation * glm::cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a));
}

void ObjectRays::closest(std::span<const WorldRay> rays, std::span<const double> most_m,
                         std::span<std::optional<ObjectPoint>> points) const {
  std::array<float, kRayBatch> nearest{};
  for (std::size_t k = 0; k < rays.size(); ++k) {
    nearest[k] = static_cast<float>(std::min(most_m[k], 1e9));
    points[k].reset();
  }
  RayPacket16 packet{};
  RayHits16 hits;
  for (std::size_t part = 0; part < placed_.size(); ++part) {
    const Placed& p = placed_[part];
    const RayScene& scene = objects_.parts[part].rays();
    std::array<std::size_t, kRayBatch> ray_of{};
    std::size_t count = 0;
    for (std::size_t k = 0; k < rays.size(); ++k)
      if (may_meet(p, rays[k], static_cast<double>(nearest[k]))) {
        packet.set(count, scene.to_local(glm::dvec3(p.own_from_world * glm::dvec4(rays[k].origin, 1.0))),
                   glm::vec3(glm::dmat3(p.own_from_world) * glm::dvec3(rays[k].direction)), 0.0f, nearest[k]);
        ray_of[count++] = k;
      }
    for (std::uint32_t met = count ? scene.closest16(packet, static_cast<int>(count), hits) : 0; met; met &= met - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(met));
      nearest[ray_of[lane]] = hits.distance[lane];
      points[ray_of[lane]] = ObjectPoint{
          part, hits.triangle[lane], hits.u[lane], hits.v[lane], static_cast<double>(hits.distance[lane]), {}, {}};
    }
  }
  for (std::size_t k = 0; k < rays.size(); ++k)
    if (points[k])
      complete(rays[k], *points[k]);
}

/// Product over the faces on the way.
Rgb ObjectRays::transmittance(const WorldRay& ray, double most_m, Parts parts) const {
  Rgb left(1.0f);
  WorldRay rest = ray;
  for (int face = 0; face < kMostFaces; ++face) {
    const auto point = closest(rest, most_m, parts);
    if (!point)
      return left;
    left *= straight_transmittance(objects_.parts[point->part].mesh(), point->triangle, point->u, point->v,
                                   glm::dot(point->face_normal, ray.direction), static_cast<float>(point->distance));
    if (left == Rgb(0.0f))
      return left;
    rest.origin = point->position + offset_m(point->part) * glm::dvec3(ray.direction);
    most_m -= point->distance;
  }
  return Rgb(0.0f);
}

/// Parallel rays from kSides directions, even on the disc that the sphere around the part shows.
Rgb ObjectRays::mean_transmittance(std::size_t part) const {
  constexpr int kSides = 16, kRays = 32;
  const BoundingSphere& sphere = placed_[part].sphere;
  const Parts alone{part, part + 1};
  Rgb passed(0.0f);
  float met = 0.0f;
  for (int side = 0; side < kSides; ++side) {
    const double z = 1.0 - (2.0 * side + 1.0) / kSides, r = std::sqrt(1.0 - z * z), turn = 2.399963 * side;
    const glm::dvec3 towards(r * std::cos(turn), r * std::sin(turn), z);
    const OrthonormalBasis basis(towards);
    for (int k = 0; k < kRays; ++k) { // Vogel's spiral
      const double d = sphere.radius * std::sqrt((k + 0.5) / kRays), a = 2.399963 * k;
      const WorldRay ray{sphere.centre + d * (std::cos(a) * basis.u + std::sin(a) * basis.v) -
                             2.0 * sphere.radius * towards,
                         glm::vec3(towards)};
      if (!closest(ray, 4.0 * sphere.radius, alone))
        continue;
      passed += transmittance(ray, 4.0 * sphere.radius, alone);
      met += 1.0f;
    }
  }
  return met > 0.0f ? passed / met : Rgb(0.0f);
}

} // namespace daylit
