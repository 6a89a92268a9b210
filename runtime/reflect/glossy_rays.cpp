#include "runtime/reflect/glossy_rays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>

#include "scene/core/orthonormal.h"
#include "scene/material/fresnel.h"

namespace daylit {

namespace {

float largest(const Rgb& c) { return std::max({c.r, c.g, c.b}); }

constexpr int kAllColours = -1; // of a ray; else the number of the only one
constexpr std::size_t kLightPatterns = 16;
constexpr auto kSunRadius = static_cast<float>(kSunAngularRadius);
constexpr float kNoDisc_rad = 1e-6f;   // width of a ray that does not see the sun
constexpr float kLeastSharing = 0.02f; // slope from which a lobe's tails are wide enough to meet windows by chance
constexpr float kFaintest = 1e-4f;     // of a light's irradiance

/// The pixel is narrower than the sun in the mirror.
bool meets_disc(float turn_rad) { return turn_rad < kSunRadius; }

} // namespace

struct GlossyRays::Surface {
  SurfaceMaterial material;
  glm::vec3 tangent{0.0f}, bitangent{0.0f}, normal{0.0f}; ///< world
  glm::vec3 out{0.0f};                                    ///< local, towards where the ray came from
  Bsdf bsdf;

  float alpha() const { return std::min(material.alpha_u, material.alpha_v); }
  bool is_sharp() const { return alpha() < kWideAlpha; }
  bool has_sharp_coat() const { return material.clearcoat > 0.0f && material.clearcoat_alpha < kWideAlpha; }
  glm::vec3 to_world(const glm::vec3& v) const { return v.x * tangent + v.y * bitangent + v.z * normal; }
  glm::vec3 to_local(const glm::vec3& v) const {
    return {glm::dot(v, tangent), glm::dot(v, bitangent), glm::dot(v, normal)};
  }
};

GlossyRays::GlossyRays(const RoomSeen& room, std::span<const TwoSided> sent, std::span<const TwoSided> indirect,
                       std::span<const DirectionalLight> sky, const GlossySettings& settings)
    : room_(room), sent_(sent), indirect_(indirect), sky_(sky), settings_(settings) {
  for (const DirectionalLight& l : sky)
    sky_luminance_ += luminance(l.irradiance);
}

const ObjectMaterial* GlossyRays::material(const ObjectPoint& point) const {
  return room_.objects.objects().parts[point.part].mesh.material_or_null(point.triangle);
}

/// The shading frame, on the side of the mesh's outside; a surface that is not transparent has no inside, its frame is
/// on the side that is seen.
GlossyRays::Surface GlossyRays::surface(const WorldRay& ray, const ObjectPoint& point, double width_m,
                                        int channel) const {
  const VirtualObjects& objects = room_.objects.objects();
  const ObjectMesh& mesh = objects.parts[point.part].mesh;
  const double scale = room_.objects.scale(point.part);
  const SurfaceLook look = surface_look(mesh, point.triangle, point.u, point.v, static_cast<float>(width_m / scale));
  const glm::mat3& rotation = room_.objects.rotation(point.part);
  glm::vec3 normal = glm::normalize(rotation * look.normal), face = point.face_normal;
  SurfaceMaterial material = look.material;
  if (channel != kAllColours)
    material.ior = material.ior_of(channel);
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

/// Light of the vertices, of the base's colour here.
Rgb GlossyRays::diffuse_of(std::span<const TwoSided> all, const ObjectPoint& point, const Surface& s) const {
  const VirtualObjects& objects = room_.objects.objects();
  const VirtualObjects::Part& part = objects.parts[point.part];
  const auto& t = part.mesh.triangles[point.triangle];
  const float weight[3] = {1.0f - point.u - point.v, point.u, point.v};
  const bool back = glm::dot(s.normal, point.face_normal) < 0.0f;
  Rgb radiance(0.0f), reflectance(0.0f);
  for (std::size_t k = 0; k < 3; ++k) {
    const TwoSided& vertex = all[part.first_vertex + t[k]];
    radiance += weight[k] * (back ? vertex.back : vertex.front);
    reflectance += weight[k] * objects.surface.reflectance[part.first_vertex + t[k]];
  }
  return radiance * s.bsdf.diffuse_albedo(s.out) / glm::max(reflectance, Rgb(kLeastReflectance));
}

/// glTF 2.0, section 3.9.3: indirect light alone.
Rgb GlossyRays::occluded(const ObjectPoint& point, const Surface& s) const {
  return s.material.occlusion < 1.0f ? (1.0f - s.material.occlusion) * diffuse_of(indirect_, point, s) : Rgb(0.0f);
}

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
  const ObjectMesh& mesh = room_.objects.objects().parts[point.part].mesh;
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

/// f(out, sun) cos E. Facets are spread by the turn of the normal in a pixel (alpha^2 = turn^2 / pi: in the middle as
/// bright as the mean over a square of that side; Kaplanyan et al. 2016) and by the disc (a quarter of the variance of
/// its radius, for half vectors). A sharp lobe whose pixel is narrower than the disc meets it with its ray.
Rgb GlossyRays::glint(const ObjectPoint& point, const Surface& s, float turn_rad) const {
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
  return largest(f) > kFaintest ? f * room_.sun_at(*x) : Rgb(0.0f);
}

/// The tails of a lobe are wide and seldom sampled: there a window is found by chance, and is much brighter than what
/// is around it. A mirrored lobe alone on its surface finds the sky by the frame's lights as well.
bool GlossyRays::shares_sky(const Surface& s) const {
  return !sky_.empty() && s.alpha() >= kLeastSharing && s.bsdf.mirrors_only();
}

/// Power heuristic (Veach & Guibas 1995): a^2 / (a^2 + b^2), a: density of all samples of the lobe, b: of the lights,
/// which lie as dense as the sky is bright.
float GlossyRays::lobe_part(float lobe_density, const glm::vec3& direction, float width_rad) const {
  const float count = static_cast<float>(sky_.size()) / kLightPatterns,
              lights = count * luminance(room_.sky(direction, width_rad)) / sky_luminance_;
  return lobe_density * lobe_density / std::max(lobe_density * lobe_density + lights * lights, 1e-30f);
}

/// sum f cos E T V of the lights of one pattern, times the number of patterns, times what the lobe's samples leave.
Rgb GlossyRays::sky_highlight(const CameraPoint& at, const Surface& s) const {
  Rgb sum(0.0f);
  for (auto j = static_cast<std::size_t>(at.lights); j < sky_.size(); j += kLightPatterns) {
    const glm::vec3 direction(sky_[j].direction), in = s.to_local(direction);
    const auto x = lit_from(at.point, s, direction);
    if (!x)
      continue;
    const float density = static_cast<float>(at.places.size()) * s.bsdf.mirrored_density(s.out, in);
    const Rgb weight = (1.0f - lobe_part(density, direction, s.alpha())) * in.z * s.bsdf.glossy(s.out, in);
    if (largest(weight) * static_cast<float>(kLightPatterns) > kFaintest)
      sum +=
          static_cast<float>(kLightPatterns) * weight * sky_[j].irradiance * room_.arrives_from(*x, sky_[j].direction);
  }
  return sum;
}

/// A ray of the tree, from outside or inside the objects.
struct GlossyRays::Branch {
  WorldRay ray;
  Rgb weight{1.0f};           ///< what of the light along it reaches the camera
  Rgb absorption_per_m{0.0f}; ///< of what it runs through
  std::uint32_t tree = 0;
  int depth = 0, channel = kAllColours;
  bool inside = false;
  float width_rad = 0.0f;    ///< RoomRay::width_rad
  float lobe_density = 0.0f; ///< of all samples of its lobe, per sr, where lights find the sky, too; 0: they do not
};

/// Trees of rays, each of one sample of a lobe at the camera, grown together.
struct GlossyRays::Work {
  struct Tree {
    Rgb* radiance = nullptr; ///< where its light is added to
    float share = 1.0f;      ///< times this
    glm::vec2 u{0.5f};       ///< place in the lobes
    int rays_left = 0;
  };
  std::vector<Tree> trees;
  std::vector<Branch> level, next;
  std::uint64_t rays = 0;

  void add(std::uint32_t tree, const Rgb& radiance) { *trees[tree].radiance += trees[tree].share * radiance; }
};

/// Against the face a ray goes on just above it, or below.
WorldRay GlossyRays::onward(const ObjectPoint& point, const Surface& s, const glm::vec3& local) const {
  glm::vec3 direction = s.to_world(local);
  const float wanted = local.z > 0.0f ? 1.0f : -1.0f, face_sign = glm::dot(s.normal, point.face_normal);
  const glm::vec3 face = (face_sign < 0.0f ? -wanted : wanted) * point.face_normal;
  if (const float along = glm::dot(direction, face); along <= 1e-3f)
    direction = glm::normalize(direction + (1e-3f - along) * face);
  return {point.position + room_.objects.offset_m(point.part) * glm::dvec3(face), direction};
}

/// One ray for each lobe, the one that brings most first, as long as it brings enough.
void GlossyRays::spread(const ObjectPoint& point, const Surface& s, const Branch& from, Work& work) const {
  Work::Tree& tree = work.trees[from.tree];
  const glm::vec2 u = from.depth == 0
                          ? tree.u
                          : glm::fract(tree.u + static_cast<float>(from.depth) * glm::vec2(0.754877666f, 0.569840291f));
  auto lobes = s.bsdf.sample_lobes(s.out, u);
  const auto brings = [](const std::optional<BsdfSample>& l) { return l ? largest(l->weight) : 0.0f; };
  std::ranges::sort(lobes, [&](const auto& a, const auto& b) { return brings(a) > brings(b); });
  for (const std::optional<BsdfSample>& lobe : lobes) {
    const Rgb weight = lobe ? from.weight * lobe->weight : Rgb(0.0f);
    if (tree.rays_left <= 0 || largest(weight) < settings_.least_importance)
      continue;
    --tree.rays_left;
    ++work.rays;
    const bool inside = lobe->direction.z < 0.0f && !s.material.thin;
    const float sharp_width = from.depth == 0 && lobe->transmitted ? 0.0f : from.width_rad;
    work.next.push_back({onward(point, s, lobe->direction), weight, inside ? s.material.absorption_per_m : Rgb(0.0f),
                         from.tree, from.depth + 1, from.channel, inside,
                         s.is_sharp() ? sharp_width : std::max(from.width_rad, s.alpha()),
                         from.depth == 0 ? from.lobe_density * lobe->density : 0.0f});
  }
}

/// L(ray) = exp(-a d) L at its end, on an object.
void GlossyRays::arrive(const Branch& branch, const ObjectPoint& point, Work& work) const {
  Branch left = branch;
  left.weight *= glm::exp(-branch.absorption_per_m * static_cast<float>(point.distance));
  const Surface s = surface(branch.ray, point, 0.0, branch.channel);
  Rgb sent = diffuse_of(sent_, point, s) - occluded(point, s) + s.material.emission;
  const ObjectMaterial* m = material(point);
  if (m && m->is_glossy()) {
    if (!s.is_sharp())
      sent += glint(point, s, 0.0f);
    spread(point, s, left, work);
  }
  work.add(branch.tree, left.weight * sent);
}

/// A ray inside an object meets its surface before the room. A mesh that is not closed lets it out: nothing is
/// absorbed.
void GlossyRays::step(std::span<const Branch> batch, Work& work) const {
  std::array<WorldRay, kRayBatch> rays;
  std::array<double, kRayBatch> most;
  most.fill(std::numeric_limits<double>::infinity());
  for (std::size_t k = 0; k < batch.size(); ++k)
    rays[k] = batch[k].ray;
  std::array<std::optional<ObjectPoint>, kRayBatch> points;
  room_.objects.closest({rays.data(), batch.size()}, most, points);

  std::array<RoomRay, kRayBatch> room;
  std::array<std::size_t, kRayBatch> branch_of;
  std::size_t count = 0;
  for (std::size_t k = 0; k < batch.size(); ++k)
    if (batch[k].inside && points[k])
      arrive(batch[k], *points[k], work);
    else {
      room[count] = {rays[k], points[k] ? points[k]->distance : most[k], batch[k].width_rad, std::nullopt, Rgb(0.0f)};
      branch_of[count++] = k;
    }
  room_.find_ends({room.data(), count});
  std::size_t kept = 0;
  for (std::size_t k = 0; k < count; ++k)
    if (const auto& point = points[branch_of[k]]; point && !room[k].end)
      arrive(batch[branch_of[k]], *point, work);
    else {
      room[kept] = room[k];
      branch_of[kept++] = branch_of[k];
    }
  room_.find_radiance({room.data(), kept});
  for (std::size_t k = 0; k < kept; ++k) {
    const Branch& b = batch[branch_of[k]];
    const bool shared = b.lobe_density > 0.0f && !room[k].end;
    const float part = shared ? lobe_part(b.lobe_density, b.ray.direction, b.width_rad) : 1.0f;
    work.add(b.tree, part * b.weight * room[k].radiance);
  }
}

void GlossyRays::follow(Work& work) const {
  for (; !work.level.empty(); std::swap(work.level, work.next)) {
    work.next.clear();
    const std::span<const Branch> level(work.level);
    for (std::size_t first = 0; first < level.size(); first += kRayBatch)
      step(level.subspan(first, std::min(kRayBatch, level.size() - first)), work);
  }
}

void GlossyRays::radiance(std::span<const WorldRay> rays, std::span<Rgb> radiances) const {
  Work work;
  for (std::size_t k = 0; k < rays.size(); ++k) {
    radiances[k] = Rgb(0.0f);
    work.trees.push_back({&radiances[k], 1.0f, glm::vec2(0.5f), settings_.most_rays});
    work.level.push_back(
        {rays[k], Rgb(1.0f), Rgb(0.0f), static_cast<std::uint32_t>(k), 1, kAllColours, false, 0.0f, 0.0f});
  }
  follow(work);
}

/// Where colours are bent apart, a tree for each.
void GlossyRays::spread_from_camera(const CameraPoint& at, const Surface& s, float width_rad, GlossyLight& light,
                                    Work& work) const {
  const auto grow = [&](const Surface& surface, const Rgb& weight, int channel) {
    for (const glm::vec2& u : s.is_sharp() ? at.places.first(1) : at.places) {
      work.trees.push_back(
          {&light.radiance, s.is_sharp() ? 1.0f : 1.0f / static_cast<float>(at.places.size()), u, settings_.most_rays});
      Branch camera{at.ray, weight,    Rgb(0.0f), static_cast<std::uint32_t>(work.trees.size() - 1), 0, channel,
                    false,  width_rad, 0.0f};
      if (shares_sky(surface))
        camera.lobe_density = static_cast<float>(at.places.size());
      spread(at.point, surface, camera, work);
    }
  };
  if (!s.material.disperses())
    return grow(s, Rgb(1.0f), kAllColours);
  for (int c = 0; c < 3; ++c) {
    Rgb only(0.0f);
    only[c] = 1.0f;
    grow(surface(at.ray, at.point, at.width_m, c), only, c);
  }
}

std::uint64_t GlossyRays::look(std::span<const CameraPoint> points, std::span<GlossyLight> lights) const {
  Work work;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const ObjectPoint& point = points[k].point;
    const Surface s = surface(points[k].ray, point, points[k].width_m, kAllColours);
    lights[k] = {s.bsdf.diffuse_albedo(s.out), s.material.emission, Rgb(0.0f), occluded(point, s), s.normal, 0.0f};
    const ObjectMaterial* m = material(point);
    if (!m || !m->is_glossy())
      continue;
    lights[k].alpha = s.alpha();
    const float turn_rad = turn_in(point, points[k].width_m);
    lights[k].glint = glint(point, s, turn_rad);
    if (shares_sky(s))
      lights[k].radiance += sky_highlight(points[k], s);
    spread_from_camera(points[k], s, s.is_sharp() && meets_disc(turn_rad) ? 0.0f : kNoDisc_rad, lights[k], work);
  }
  std::swap(work.level, work.next);
  follow(work);
  return work.rays;
}

} // namespace daylit
