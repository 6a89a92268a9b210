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

#include "runtime/reflect/glossy_branch.h"
#include "runtime/reflect/glossy_surface.h"
#include "runtime/reflect/lobe_places.h"
#include "runtime/reflect/object_maps.h"
#include "scene/core/orthonormal.h"

namespace daylit {

namespace {

constexpr float kGrazing = 1e-3f;    // least cosine of a ray to the face that it leaves
constexpr float kNoDisc_rad = 1e-6f; // width of a ray that does not see the sun
constexpr float kPicture = 0.1f;     // of its light to the camera: what brings less is no picture of its own
constexpr int kFirstSurfaces = 2;    // whose mirror images in glass are all followed
constexpr int kMostTotal = 48;       // total reflections on one way, beside the surfaces that light leaves by
constexpr float kLightsFrom = 0.05f; // slope from which a lobe that a ray meets is wider than the lights lie apart
constexpr double kFar_m = std::numeric_limits<double>::infinity();

/// Points that are looked up one after the other mostly are of one material.
const Bsdf& bsdf_of(const SurfaceMaterial& material) {
  thread_local SurfaceMaterial latest;
  thread_local Bsdf made(latest);
  if (!(material == latest)) {
    made = Bsdf(material);
    latest = material;
  }
  return made;
}

/// All light that goes on is reflected one way.
bool is_alone(std::span<const std::optional<BsdfSample>> lobes) {
  const auto count = std::ranges::count_if(lobes, [](const auto& lobe) { return lobe.has_value(); });
  return count == 1 && std::ranges::none_of(lobes, [](const auto& lobe) { return lobe && lobe->transmitted; });
}

/// What is left of light that has yet to go a way inside, about as long as the one before, and out by one face.
Rgb way_out(const SurfaceMaterial& m, double distance) {
  return m.base_colour * glm::exp(-m.absorption_per_m * static_cast<float>(distance));
}

} // namespace

GlossyRays::GlossyRays(const RoomSeen& room, std::span<const TwoSided> sent, std::span<const TwoSided> indirect,
                       std::span<const DirectionalLight> sky, const GlossySettings& settings,
                       std::span<const Sh9Rgb> arriving)
    : room_(room), sent_(sent), indirect_(indirect), sky_(sky), settings_(settings), arriving_(arriving) {
  for (const DirectionalLight& l : sky)
    sky_luminance_ += luminance(l.irradiance);
}

const ObjectMaterial* GlossyRays::material(const ObjectPoint& point) const {
  return room_.objects.objects().parts[point.part].mesh().material_or_null(point.triangle);
}

/// The shading frame, on the side of the mesh's outside; a surface that is not transparent has no inside, its frame is
/// on the side that is seen.
GlossyRays::Surface GlossyRays::surface(const WorldRay& ray, const ObjectPoint& point, double width_m,
                                        int channel) const {
  const VirtualObjects& objects = room_.objects.objects();
  const ObjectMesh& mesh = objects.parts[point.part].mesh();
  const double scale = room_.objects.scale(point.part);
  const SurfaceLook look = surface_look(mesh, point.triangle, point.u, point.v, static_cast<float>(width_m / scale));
  const glm::mat3& rotation = room_.objects.rotation(point.part);
  glm::vec3 normal = glm::normalize(rotation * look.normal), smooth = rotation * look.smooth, face = point.face_normal;
  SurfaceMaterial material = look.material;
  if (channel != kAllColours)
    material.ior = material.ior_of(channel);
  const bool inside = glm::dot(face, ray.direction) > 0.0f;
  if (inside && (material.transmission == 0.0f || material.thin)) {
    normal = -normal;
    smooth = -smooth;
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
  Surface s{material, tangent, glm::cross(normal, tangent), normal, smooth, {}, bsdf_of(material)};
  s.out = s.to_local(out);
  return s;
}

/// Against the face a ray goes on just above it, or below.
WorldRay GlossyRays::onward(const ObjectPoint& point, const Surface& s, const glm::vec3& local) const {
  glm::vec3 direction = s.to_world(local);
  const float wanted = local.z > 0.0f ? 1.0f : -1.0f, face_sign = glm::dot(s.normal, point.face_normal);
  const glm::vec3 face = (face_sign < 0.0f ? -wanted : wanted) * point.face_normal;
  if (const float along = glm::dot(direction, face); along <= kGrazing)
    direction = glm::normalize(direction + (kGrazing - along) * face);
  return {point.position + room_.objects.offset_m(point.part) * glm::dvec3(face), direction};
}

/// One ray for the brightest lobe and for each other that brings enough: few do, since all of a sample bring at most 1
/// together. Those left out, and what would run on inside after the last ray, look somewhere, to all sides: they are as
/// bright as the room's light on the surface here, E / pi, so that no light is lost but what glass absorbs. Rough ones
/// see a window as well.
void GlossyRays::spread(const ObjectPoint& point, const Surface& s, const Branch& from, const glm::vec2& place,
                        Work& work) const {
  if (from.depth >= settings_.most_depth)
    return;
  const Work::Tree& tree = work.trees[from.tree];
  const auto lobes = s.bsdf.sample_lobes(s.out, place_after(place, from.lobes));
  const auto brings = [&](std::size_t k) { return lobes[k] ? largest(lobes[k]->weight) : 0.0f; };
  std::size_t brightest = 0;
  for (std::size_t k = 1; k < lobes.size(); ++k)
    brightest = brings(k) > brings(brightest) ? k : brightest;
  const float least = from.depth == 0                               ? settings_.least_first
                      : from.inside && from.depth >= kFirstSurfaces ? settings_.least_inside
                                                                    : settings_.least_importance;
  const bool alone = is_alone(lobes) && largest(from.weight) * brings(brightest) >= kPicture;
  const bool counts = !alone || from.uncounted >= (from.inside ? kMostTotal : settings_.most_more) ||
                      !(from.inside ? s.is_sharp() : from.depth + 1 == settings_.most_depth);
  Rgb not_followed(0.0f);
  for (std::size_t k = 0; k < lobes.size(); ++k) {
    const std::optional<BsdfSample>& lobe = lobes[k];
    if (!lobe)
      continue;
    const bool apart = k == 0 && from.depth == 0 && tree.of_coat != Work::kThisTree;
    const bool inside = lobe->direction.z < 0.0f && !s.material.thin;
    const Rgb weight = from.weight * lobe->weight;
    const bool is_last = inside && counts && from.depth + 1 >= settings_.most_depth;
    if (is_last || (k != brightest && largest(weight) < least)) {
      not_followed += inside ? weight * way_out(s.material, from.inside ? point.distance : 0.0) : weight;
      continue;
    }
    ++work.rays;
    const float sharp_width = from.depth == 0 && lobe->transmitted ? 0.0f : from.width_rad;
    work.next.push_back(
        {onward(point, s, lobe->direction), weight, inside ? s.material.absorption_per_m : Rgb(0.0f),
         apart ? tree.of_coat : from.tree, from.depth + (counts ? 1 : 0), from.channel, inside,
         s.is_sharp() ? sharp_width : std::max(from.width_rad, apart ? s.material.clearcoat_alpha : s.alpha()),
         from.lobe_density * lobe->density, lobe->transmitted ? 0 : from.light_step, glm::dvec3(0.0)});
    if (lobe->transmitted)
      work.next.back().room_from = 2.0 * (point.position - work.next.back().ray.origin);
    work.next.back().sky_is_known = lobe->transmitted && finds_sky_behind(from.inside, s);
    work.next.back().uncounted = from.uncounted + (counts ? 0 : 1);
    work.next.back().lobes = from.lobes + (s.is_sharp() || (k == 0 && s.has_sharp_coat()) ? 0 : 1);
  }
  if (not_followed != Rgb(0.0f))
    work.add(from.tree, not_followed * arriving_at(s.is_sharp() ? indirect_ : sent_, point, s));
}

/// How far half vectors turn within the part of a lobe that a ray stands for, radians: with its directions, and with
/// the normals of all that it meets, where the surface bends most.
float GlossyRays::turn_along(const Branch& branch, const ObjectPoint& point, const Surface& s) const {
  constexpr float kMost_rad = 0.5f;
  const float width_rad = 2.0f * branch.width_rad; // to both sides
  const glm::mat2 turn = static_cast<float>(point.distance) * width_rad * curvature(point, s);
  return width_rad + std::min(Axes(turn * glm::transpose(turn)).length.x, kMost_rad);
}

/// What the lobes at the end of a ray find of the sky by one of the frame's lights; `onward`: the rays that share it.
Rgb GlossyRays::one_light(const ObjectPoint& point, const Surface& s, Branch& onward, const glm::vec2& u) const {
  onward.lobe_density = 1.0f;
  onward.light_step = sky_.size();
  const auto count = static_cast<float>(sky_.size());
  const auto light = static_cast<std::size_t>(place_after(u, onward.lobes).x * count);
  return sky_highlight(point, s, 1.0f, std::min(light, sky_.size() - 1), sky_.size());
}

/// One ray for each place, and the sky by as many of the frame's lights as a pixel of a rough surface looks at; what
/// these find of it is returned.
Rgb GlossyRays::spread_several(const ObjectPoint& point, const Surface& s, Branch onward, Work& work) const {
  const Work::Tree& tree = work.trees[onward.tree];
  const auto count = static_cast<float>(tree.next_places.size());
  Rgb found(0.0f);
  if (shares_sky(s)) {
    onward.lobe_density = count;
    onward.light_step = kLightPatterns;
    found = sky_highlight(point, s, count, static_cast<std::size_t>(tree.lights) % kLightPatterns, kLightPatterns);
  }
  onward.weight /= count;
  for (const glm::vec2& place : tree.next_places)
    spread(point, s, onward, place, work);
  return found;
}

/// L(ray) = exp(-a d) L at its end, on an object.
void GlossyRays::arrive(const Branch& branch, const ObjectPoint& point, Work& work) const {
  Branch left = branch;
  if (int* met = work.trees[branch.tree].met; met && branch.depth == 1 && !branch.inside)
    ++*met;
  if (branch.absorption_per_m != Rgb(0.0f))
    left.weight *= glm::exp(-branch.absorption_per_m * static_cast<float>(point.distance));
  const Surface s = surface(branch.ray, point, 0.0, branch.channel);
  Rgb sent = diffuse_of(sent_, point, s) - occluded(point, s) + s.material.emission;
  const ObjectMaterial* m = material(point);
  if (m && m->is_glossy()) {
    if (!s.is_sharp())
      sent += glint(point, s, even_spread(turn_along(branch, point, s)), work.trees[branch.tree].u.y);
    left.light_step = 0;
    const Work::Tree& tree = work.trees[branch.tree];
    const bool shows_picture = branch.width_rad <= kNoDisc_rad && largest(left.weight) >= kPicture;
    const bool several = shows_picture && !branch.inside && !s.is_sharp() && !tree.next_places.empty();
    if (finds_sky_behind(branch.inside, s))
      sent += sky_behind(point, s, branch.width_rad, static_cast<std::size_t>(tree.lights));
    else if (several)
      sent += spread_several(point, s, left, work);
    else if (!branch.inside && tree.takes_lights && s.alpha() >= kLightsFrom && !sky_.empty())
      sent += one_light(point, s, left, tree.u);
    if (!several)
      spread(point, s, left, tree.u, work);
  }
  work.add(branch.tree, left.weight * sent);
}

/// A declared surface of the room mirrors the ray. False: none does, or the image brings too little.
bool GlossyRays::mirror_in_room(const Branch& branch, const RoomRay& met, Work& work) const {
  const auto mirrored = met.end ? room_.mirrored(met.ray, *met.end) : std::nullopt;
  if (!mirrored || branch.depth >= settings_.most_depth ||
      mirrored->share * largest(branch.weight) < settings_.least_importance)
    return false;
  ++work.rays;
  work.next.push_back({mirrored->ray, mirrored->share * branch.weight, Rgb(0.0f), branch.tree, branch.depth + 1,
                       branch.channel, false, branch.width_rad});
  work.next.back().lobes = branch.lobes;
  return true;
}

/// A ray inside an object meets its surface before the room; a mesh that is not closed lets it out. The last ray of a
/// sample goes on past objects, and below one finds the room's light as if it were not there.
void GlossyRays::step(std::span<const Branch> batch, Work& work) const {
  std::array<WorldRay, kRayBatch> rays;
  std::array<double, kRayBatch> most;
  for (std::size_t k = 0; k < batch.size(); ++k) {
    rays[k] = batch[k].ray;
    most[k] = batch[k].depth < settings_.most_depth ? kFar_m : 0.0;
  }
  std::array<std::optional<ObjectPoint>, kRayBatch> points;
  room_.objects.closest({rays.data(), batch.size()}, most, points);

  std::array<RoomRay, kRayBatch> room;
  std::array<std::size_t, kRayBatch> branch_of;
  std::size_t count = 0;
  for (std::size_t k = 0; k < batch.size(); ++k)
    if (batch[k].inside && points[k])
      arrive(batch[k], *points[k], work);
    else {
      room[count] = {{rays[k].origin + batch[k].room_from, rays[k].direction},
                     points[k] ? points[k]->distance : kFar_m,
                     batch[k].width_rad,
                     std::nullopt,
                     Rgb(0.0f),
                     batch[k].depth >= settings_.most_depth};
      branch_of[count++] = k;
    }
  room_.find_ends({room.data(), count});
  std::size_t kept = 0;
  for (std::size_t k = 0; k < count; ++k)
    if (const auto& point = points[branch_of[k]]; point && !room[k].end)
      arrive(batch[branch_of[k]], *point, work);
    else {
      room[kept] = room[k];
      room[kept].without_gloss = mirror_in_room(batch[branch_of[k]], room[k], work);
      branch_of[kept++] = branch_of[k];
    }
  room_.find_radiance({room.data(), kept});
  for (std::size_t k = 0; k < kept; ++k) {
    const Branch& b = batch[branch_of[k]];
    if (b.sky_is_known && !room[k].end)
      continue;
    const bool shared = b.light_step > 0 && !room[k].end;
    const float part =
        shared ? lobe_part(b.lobe_density, light_density(b.ray.direction, b.width_rad, b.light_step)) : 1.0f;
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

void GlossyRays::radiance(std::span<const WorldRay> rays, std::span<Rgb> radiances, float width_rad) const {
  Work work;
  for (std::size_t k = 0; k < rays.size(); ++k) {
    radiances[k] = Rgb(0.0f);
    work.trees.push_back({&radiances[k], 1.0f, glm::vec2(0.5f), Work::kThisTree, false});
    work.level.push_back(
        {rays[k], Rgb(1.0f), Rgb(0.0f), static_cast<std::uint32_t>(k), 1, kAllColours, false, width_rad, 0.0f});
  }
  follow(work);
}

/// Where colours are bent apart, a tree for each.
void GlossyRays::spread_from_camera(const CameraPoint& at, const Surface& s, float width_rad, GlossyLight& light,
                                    Work& work) const {
  const auto grow = [&](const Surface& surface, const Rgb& weight, int channel) {
    for (const glm::vec2& u : s.is_sharp() ? at.places.first(1) : at.places) {
      work.trees.push_back({&light.radiance, s.is_sharp() ? 1.0f : 1.0f / static_cast<float>(at.places.size()), u});
      const auto tree = static_cast<std::uint32_t>(work.trees.size() - 1);
      work.trees[tree].lights = at.lights + static_cast<int>(&u - at.places.data());
      if (s.is_sharp())
        work.trees[tree].next_places = at.places;
      else
        work.trees[tree].met = &light.met;
      if (s.has_sharp_coat() && !s.is_sharp()) {
        work.trees[tree].of_coat = tree + 1;
        work.trees.push_back({&light.coat, work.trees[tree].share, u});
      }
      Branch camera{at.ray, weight, Rgb(0.0f), tree, 0, channel, false, width_rad, 0.0f};
      if (shares_sky(surface)) {
        camera.lobe_density = static_cast<float>(at.places.size());
        camera.light_step = kLightPatterns;
      }
      spread(at.point, surface, camera, u, work);
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
    lights[k] = {s.bsdf.diffuse_albedo(s.out), Rgb(0.0f),          Rgb(1.0f), Rgb(0.0f),
                 s.material.emission,          occluded(point, s), s.normal,  0.0f};
    lights[k].opaque = s.material.transmission == 0.0f;
    const ObjectMaterial* m = material(point);
    if (m && (m->normal_texture || m->is_glossy()) && lights[k].diffuse != Rgb(0.0f))
      shade_relief(point, s, lights[k]);
    if (!m || !m->is_glossy())
      continue;
    if (const Surroundings* around = surroundings(point, s)) {
      NormalSpread spread = spread_seen(point, points[k].width_m, s);
      if (meets_disc(Axes(spread).length.x)) // no ray does
        spread = even_spread(kSunRadius);
      lights[k].radiance += looked_up(*around, point, s);
      lights[k].glint += glint(point, s, spread, points[k].lights / 16.0);
      continue;
    }
    lights[k].alpha = s.alpha();
    if (!s.is_sharp())
      lights[k].albedo = s.bsdf.reflected_albedo(s.out) + s.bsdf.transmitted_albedo(s.out);
    if (shares_sky(s))
      lights[k].radiance += sky_highlight(point, s, static_cast<float>(points[k].places.size()),
                                          static_cast<std::size_t>(points[k].lights), kLightPatterns);
    float width_rad = 0.0f;
    if (room_.sun) {
      const NormalSpread spread = spread_seen(point, points[k].width_m, s);
      lights[k].glint += glint(point, s, spread, points[k].lights / 16.0);
      width_rad = s.is_sharp() && meets_disc(Axes(spread).length.x) ? 0.0f : kNoDisc_rad;
    }
    spread_from_camera(points[k], s, width_rad, lights[k], work);
  }
  std::swap(work.level, work.next);
  follow(work);
  return work.rays;
}

} // namespace daylit
