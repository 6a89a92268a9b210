#include "runtime/reflect/glossy_rays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>

#include "runtime/base/orthonormal.h"

namespace daylit {

namespace {

float largest(const Rgb& c) { return std::max({c.r, c.g, c.b}); }

} // namespace

struct GlossyRays::Surface {
  SurfaceMaterial material;
  glm::vec3 tangent{0.0f}, bitangent{0.0f}, normal{0.0f}; ///< world
  glm::vec3 out{0.0f};                                    ///< local, towards where the ray came from
  Bsdf bsdf;

  float alpha() const { return std::min(material.alpha_u, material.alpha_v); }
  bool is_sharp() const { return alpha() < kWideAlpha; }
  glm::vec3 to_world(const glm::vec3& v) const { return v.x * tangent + v.y * bitangent + v.z * normal; }
  glm::vec3 to_local(const glm::vec3& v) const {
    return {glm::dot(v, tangent), glm::dot(v, bitangent), glm::dot(v, normal)};
  }
};

GlossyRays::GlossyRays(const RoomSeen& room, std::span<const TwoSided> sent, const GlossySettings& settings)
    : room_(room), sent_(sent), settings_(settings) {}

const ObjectMaterial* GlossyRays::material(const ObjectPoint& point) const {
  return room_.objects.objects().parts[point.part].mesh.material_or_null(point.triangle);
}

/// The shading frame, on the side of the mesh's outside; a surface that is not transparent has no inside, its frame is
/// on the side that is seen.
GlossyRays::Surface GlossyRays::surface(const WorldRay& ray, const ObjectPoint& point, double width_m) const {
  const VirtualObjects& objects = room_.objects.objects();
  const ObjectMesh& mesh = objects.parts[point.part].mesh;
  const double scale = room_.objects.scale(point.part);
  const SurfaceLook look = surface_look(mesh, point.triangle, point.u, point.v, static_cast<float>(width_m / scale));
  const glm::mat3& rotation = room_.objects.rotation(point.part);
  glm::vec3 normal = glm::normalize(rotation * look.normal), face = point.face_normal;
  SurfaceMaterial material = look.material;
  const bool inside = glm::dot(face, ray.direction) > 0.0f;
  if (inside && (material.transmission == 0.0f || material.thin)) {
    normal = -normal;
    face = -face;
  }
  // A shading normal that faces away from the camera is bent to where it does not (Keller et al. 2017, chapter 3).
  const glm::vec3 out = -ray.direction, side = glm::dot(face, out) < 0.0f ? -out : out;
  if (const float away = glm::dot(normal, side); away <= 0.02f)
    normal = glm::normalize(normal + (0.02f - away) * side);
  glm::vec3 tangent = rotation * look.tangent;
  tangent -= glm::dot(tangent, normal) * normal;
  if (glm::dot(tangent, tangent) < 1e-8f) {
    const OrthonormalBasis basis{glm::dvec3(normal)};
    tangent = glm::vec3(basis.u);
  }
  tangent = glm::normalize(tangent);
  Surface s{material, tangent, glm::cross(normal, tangent), normal, {}, Bsdf(material)};
  s.out = s.to_local(out);
  return s;
}

/// Light of the vertices, and of the surface itself.
Rgb GlossyRays::sent_by(const ObjectPoint& point, const Surface& s) const {
  const VirtualObjects& objects = room_.objects.objects();
  const VirtualObjects::Part& part = objects.parts[point.part];
  const auto& t = part.mesh.triangles[point.triangle];
  const float weight[3] = {1.0f - point.u - point.v, point.u, point.v};
  const bool back = glm::dot(s.normal, point.face_normal) < 0.0f;
  Rgb radiance(0.0f), reflectance(0.0f);
  for (std::size_t k = 0; k < 3; ++k) {
    const TwoSided& vertex = sent_[part.first_vertex + t[k]];
    radiance += weight[k] * (back ? vertex.back : vertex.front);
    reflectance += weight[k] * objects.surface.reflectance[part.first_vertex + t[k]];
  }
  return radiance * s.bsdf.diffuse_albedo(s.out) / glm::max(reflectance, Rgb(kLeastReflectance)) + s.material.emission;
}

/// f(out, sun) cos E. The disc is narrower than a wide lobe; a sharp one meets it with its ray, or does not.
Rgb GlossyRays::glint(const ObjectPoint& point, const Surface& s) const {
  if (!room_.sun || s.is_sharp())
    return Rgb(0.0f);
  const glm::vec3 to_sun(room_.sun->direction), in = s.to_local(to_sun);
  if (in.z <= 0.0f || glm::dot(to_sun, point.face_normal) * glm::dot(s.normal, point.face_normal) <= 0.0f)
    return Rgb(0.0f);
  const Rgb f = s.bsdf.glossy(s.out, in) * in.z;
  if (largest(f) <= 0.0f)
    return Rgb(0.0f);
  const float side = glm::dot(s.normal, point.face_normal) < 0.0f ? -1.0f : 1.0f;
  const double offset = room_.objects.offset_m(point.part);
  return f * room_.sun_at(point.position + offset * static_cast<double>(side) * glm::dvec3(point.face_normal));
}

/// What a sample of a lobe brings: weight x the radiance along it.
Rgb GlossyRays::branch(const ObjectPoint& point, const Surface& s, const BsdfSample& sample, float importance,
                       Path& path) const {
  if (path.rays_left <= 0 || importance * largest(sample.weight) < settings_.least_importance)
    return Rgb(0.0f);
  --path.rays_left;
  ++path.rays;
  glm::vec3 direction = s.to_world(sample.direction);
  // Against the face it goes on just above it, or below.
  const float wanted = sample.direction.z > 0.0f ? 1.0f : -1.0f, face_sign = glm::dot(s.normal, point.face_normal);
  const glm::vec3 face = (face_sign < 0.0f ? -wanted : wanted) * point.face_normal;
  if (const float along = glm::dot(direction, face); along <= 1e-3f)
    direction = glm::normalize(direction + (1e-3f - along) * face);
  const double offset = room_.objects.offset_m(point.part);
  const WorldRay next{point.position + offset * glm::dvec3(face), direction};
  const Rgb absorption = sample.direction.z < 0.0f && !s.material.thin ? s.material.absorption_per_m : Rgb(0.0f);
  ++path.depth;
  const Rgb found = along(next, importance * largest(sample.weight), absorption, s.is_sharp(), path);
  --path.depth;
  return sample.weight * found;
}

/// The lobe that brings most first; what the others are worth decides whether they are followed.
Rgb GlossyRays::glossy(const ObjectPoint& point, const Surface& s, float importance, Path& path) const {
  Rgb sum(0.0f);
  const glm::vec2 u = path.depth == 0
                          ? path.u
                          : glm::fract(path.u + static_cast<float>(path.depth) * glm::vec2(0.754877666f, 0.569840291f));
  std::array<std::optional<BsdfSample>, Bsdf::kLobes.size()> lobes;
  for (std::size_t k = 0; k < lobes.size(); ++k)
    lobes[k] = s.bsdf.sample_lobe(Bsdf::kLobes[k], s.out, u);
  const auto brings = [](const std::optional<BsdfSample>& l) { return l ? largest(l->weight) : 0.0f; };
  std::ranges::sort(lobes, [&](const auto& a, const auto& b) { return brings(a) > brings(b); });
  for (const std::optional<BsdfSample>& lobe : lobes)
    if (lobe)
      sum += branch(point, s, *lobe, importance, path);
  return sum;
}

/// L(ray) = exp(-a d) L at its end.
Rgb GlossyRays::along(const WorldRay& ray, float importance, const Rgb& absorption, bool with_disc, Path& path) const {
  const auto room = room_.closest(ray);
  const double most = room ? room->distance : std::numeric_limits<double>::infinity();
  const auto point = room_.objects.closest(ray, most);
  if (!point)
    return room_.radiance(ray, room, with_disc); // a mesh that is not closed lets a ray out: nothing is absorbed
  const Rgb left = glm::exp(-absorption * static_cast<float>(point->distance));
  const Surface s = surface(ray, *point, 0.0);
  Rgb sum = sent_by(*point, s);
  const ObjectMaterial* m = material(*point);
  if (m && m->is_glossy())
    sum += glint(*point, s) + glossy(*point, s, importance * largest(left), path);
  return left * sum;
}

Rgb GlossyRays::radiance(const WorldRay& ray) const {
  Path path{settings_.most_rays, 1, glm::vec2(0.5f), 0};
  return along(ray, 1.0f, Rgb(0.0f), true, path);
}

GlossyLight GlossyRays::look(const WorldRay& ray, const ObjectPoint& point, std::span<const glm::vec2> places,
                             double width_m, std::uint64_t& rays) const {
  const Surface s = surface(ray, point, width_m);
  GlossyLight light{s.bsdf.diffuse_albedo(s.out), s.material.emission, s.normal, 0.0f};
  const ObjectMaterial* m = material(point);
  if (!m || !m->is_glossy())
    return light;
  light.alpha = s.alpha();
  light.radiance += glint(point, s);
  if (s.is_sharp())
    places = places.first(1);
  for (const glm::vec2& u : places) {
    Path path{settings_.most_rays, 0, u, 0};
    light.radiance += glossy(point, s, 1.0f, path) / static_cast<float>(places.size());
    rays += path.rays;
  }
  return light;
}

} // namespace daylit
