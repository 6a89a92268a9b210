#include "runtime/reflect/object_maps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include <glm/geometric.hpp>

#include "runtime/reflect/glossy_surface.h"
#include "scene/core/parallel.h"
#include "scene/material/fresnel.h"

namespace daylit {

namespace {

constexpr double kOutside = 1.001; // radii from the centre: there rays have left the object
constexpr double kReach = 2.0;     // radii around an object that moved: itself, and its shadow where that is darkest
// Along a look-up's ray: from and to so many radii, each step so many times as far; then so many of false position.
constexpr double kFirst = 0.2, kLast = 100.0, kGrowth = 1.4;
constexpr int kRefine = 3;
// 1 / (1 + x^2), what of a GGX lobe lies beyond x = tan(half vector) / alpha, is 0.65 exp(-1.2 x^2) + 0.35 exp(-0.15
// x^2) within 0.02 (fitted); phong_exponent() stands for exp(-x^2).
constexpr float kTail = 0.35f;
constexpr double kMiddleExponent = 1.2, kTailExponent = 0.15;
constexpr double kSharpest = 0.1; // roughness; below, no blurred map is needed

/// Roughness from and to, of what mirrors and is not of glass.
struct Gloss {
  double least = 1.0, most = 0.0;
  void include(double roughness) {
    least = std::min(least, roughness);
    most = std::max(most, roughness);
  }
  bool any() const { return most >= least; }
};

bool by_map(float transmission, bool has_lobe) { return transmission == 0.0f && !has_lobe; }

Gloss gloss_of(const ObjectMesh& mesh) {
  Gloss gloss;
  for (const ObjectMaterial& m : mesh.materials) {
    if (!m.is_glossy() || !by_map(m.transmission, m.lobe.has_value()))
      continue;
    gloss.include(static_cast<double>(m.roughness));
    if (m.metallic_roughness_texture)
      gloss.include(0.0);
    if (m.clearcoat > 0.0f)
      gloss.include(m.clearcoat_roughness_texture ? 0.0 : static_cast<double>(m.clearcoat_roughness));
  }
  return gloss;
}

/// Around the vertices: closer than around the box.
BoundingSphere sphere_of(const VirtualObjects& objects, std::size_t part) {
  const VirtualObjects::Part& p = objects.parts[part];
  BoundingSphere sphere{p.sphere.centre, 0.0};
  for (std::size_t v = 0; v < p.mesh().positions.size(); ++v)
    sphere.radius =
        std::max(sphere.radius, glm::distance(objects.surface.positions[p.first_vertex + v], sphere.centre));
  return sphere;
}

void join(BoundingSphere& sphere, const BoundingSphere& other) {
  const double between = glm::distance(sphere.centre, other.centre);
  sphere.radius = std::max(sphere.radius, between + other.radius);
}

EnvironmentMap::Settings settings_for(const Gloss& gloss) {
  EnvironmentMap::Settings settings;
  settings.side = side_of_lobe(phong_exponent(std::max(gloss.least, 1e-3)), ObjectMaps::kMostSide);
  if (gloss.most < kSharpest)
    settings.roughness.clear();
  return settings;
}

/// Texels whose direction meets one of the spheres.
std::vector<std::uint32_t> texels_towards(const Surroundings& s, std::span<const BoundingSphere> spheres) {
  std::vector<std::uint32_t> texels;
  const RadianceMap& map = s.map.sharp();
  for (std::uint32_t t = 0; t < map.radiance.size(); ++t)
    if (std::ranges::any_of(spheres, [&](const BoundingSphere& sphere) {
          const glm::dvec3 to = sphere.centre - s.sphere.centre;
          const double along = glm::dot(to, map.direction(t)), reach = kReach * sphere.radius,
                       aside2 = glm::dot(to, to) - along * along;
          return glm::length(to) <= reach || (along > 0.0 && aside2 <= reach * reach);
        }))
      texels.push_back(t);
  return texels;
}

/// Of up to kRayBatch texels: radiance from there, and 1 / distance.
class TexelRays {
public:
  TexelRays(const RoomSeen& room, const GlossyRays& rays, const Surroundings& around)
      : room_(room), rays_(rays), around_(around),
        width_rad_(static_cast<float>(std::sqrt(around.map.sharp().solid_angle_sr()))),
        start_m_(kOutside * around.sphere.radius) {}

  void trace(std::span<const std::uint32_t> texels, RadianceMap& radiance, RadianceMap& nearness) const {
    std::array<RoomRay, kRayBatch> room;
    std::array<WorldRay, kRayBatch> outside;
    std::array<std::optional<ObjectPoint>, kRayBatch> others;
    for (std::size_t k = 0; k < texels.size(); ++k) {
      const glm::dvec3 d = radiance.direction(texels[k]);
      room[k].ray = {around_.sphere.centre, glm::vec3(d)};
      room[k].width_rad = width_rad_;
      outside[k] = {around_.sphere.centre + start_m_ * d, glm::vec3(d)};
    }
    find_ends({room.data(), texels.size()}, {outside.data(), texels.size()}, others);
    std::array<std::uint32_t, kRayBatch> of_room, of_others;
    std::size_t rooms = 0, objects = 0;
    for (std::size_t k = 0; k < texels.size(); ++k) {
      const double distance_m = others[k]     ? start_m_ + others[k]->distance
                                : room[k].end ? room[k].end->distance
                                              : std::numeric_limits<double>::infinity();
      nearness.radiance[texels[k]] = Rgb(static_cast<float>(1.0 / distance_m));
      (others[k] ? of_others[objects] : of_room[rooms]) = texels[k];
      if (others[k])
        outside[objects++] = outside[k];
      else
        room[rooms++] = room[k];
    }
    room_.find_radiance({room.data(), rooms});
    std::array<Rgb, kRayBatch> sent;
    rays_.radiance({outside.data(), objects}, sent, width_rad_);
    for (std::size_t k = 0; k < rooms; ++k)
      radiance.radiance[of_room[k]] = room[k].radiance;
    for (std::size_t k = 0; k < objects; ++k)
      radiance.radiance[of_others[k]] = sent[k];
  }

private:
  /// In the room, and on objects that stand before it.
  void find_ends(std::span<RoomRay> room, std::span<const WorldRay> outside,
                 std::span<std::optional<ObjectPoint>> others) const {
    room_.find_ends(room);
    std::array<double, kRayBatch> most;
    for (std::size_t k = 0; k < room.size(); ++k)
      most[k] = room[k].end ? std::max(room[k].end->distance - start_m_, 0.0) : std::numeric_limits<double>::infinity();
    room_.objects.closest(outside, most, others);
  }

  const RoomSeen& room_;
  const GlossyRays& rays_;
  const Surroundings& around_;
  float width_rad_;
  double start_m_;
};

Result<void> trace(const RoomSeen& room, const GlossyRays& rays, std::span<const std::uint32_t> texels,
                   Surroundings& around) {
  const TexelRays texel_rays(room, rays, around);
  RadianceMap radiance(around.map.sharp().side);
  parallel_for(tbb::blocked_range<std::size_t>(0, texels.size(), 16 * kRayBatch), [&](const auto& range) {
    for (std::size_t k = range.begin(); k < range.end(); k += kRayBatch)
      texel_rays.trace(texels.subspan(k, std::min(kRayBatch, range.end() - k)), radiance, around.nearness);
  });
  const auto updated = around.map.update(
      [&](const glm::vec3& direction) { return radiance.radiance[radiance.texel(direction)]; }, texels);
  if (!updated)
    return updated.error();
  around.is_traced = true;
  return {};
}

std::vector<std::uint32_t> every_texel(const Surroundings& s) {
  std::vector<std::uint32_t> texels(s.map.sharp().radiance.size());
  for (std::uint32_t t = 0; t < texels.size(); ++t)
    texels[t] = t;
  return texels;
}

} // namespace

/// From the centre to where the ray passes what the map saw, or to infinity.
glm::dvec3 Surroundings::end_of_ray(const glm::dvec3& from, const glm::dvec3& d) const {
  const auto beyond = [&](double t) { // above 0: behind what is seen there
    const glm::dvec3 at = from + t * d;
    return glm::length(at) * static_cast<double>(nearness.lookup(glm::vec3(at)).r) - 1.0;
  };
  double before = 0.0, f_before = -1.0;
  for (double t = kFirst * sphere.radius; t < kLast * sphere.radius; before = t, t *= kGrowth) {
    double f = beyond(t);
    if (f < 0.0) {
      f_before = f;
      continue;
    }
    double after = t, end = t;
    for (int k = 0; k < kRefine; ++k) {
      end = before + (after - before) * f_before / (f_before - f);
      const double f_end = beyond(end);
      (f_end < 0.0 ? before : after) = end;
      (f_end < 0.0 ? f_before : f) = f_end;
    }
    return from + end * d;
  }
  return d;
}

Rgb Surroundings::radiance(const glm::dvec3& x, const glm::vec3& direction, float alpha) const {
  const glm::vec3 seen(end_of_ray(x - sphere.centre, glm::dvec3(direction)));
  const double exponent = phong_exponent(std::sqrt(static_cast<double>(alpha)));
  if (alpha < kWideAlpha)
    return map.lookup(seen, exponent);
  return (1.0f - kTail) * map.lookup(seen, kMiddleExponent * exponent) +
         kTail * map.lookup(seen, std::max(kTailExponent * exponent, 1.0));
}

const Surroundings* ObjectMaps::of(std::size_t part) const {
  const auto found = std::ranges::find_if(
      all_, [&](const Surroundings& s) { return std::ranges::binary_search(s.parts, part) && s.is_traced; });
  return found != all_.end() ? &*found : nullptr;
}

/// Spheres of the objects that are not where they were; all count as moved where others have come.
std::vector<BoundingSphere> ObjectMaps::moved_from_and_to(const VirtualObjects& objects,
                                                          std::vector<std::uint8_t>& moved) {
  const bool same = std::ranges::equal(places_, objects.parts, {}, &Place::model, &VirtualObjects::Part::model);
  if (!same) {
    places_.assign(objects.parts.size(), {});
    all_.clear();
  }
  moved.assign(objects.parts.size(), 0);
  std::vector<BoundingSphere> spheres;
  for (std::size_t k = 0; k < places_.size(); ++k) {
    const VirtualObjects::Part& part = objects.parts[k];
    if (same && places_[k].world_from_object == part.world_from_object)
      continue;
    moved[k] = 1;
    spheres.push_back(places_[k].sphere);
    places_[k] = {part.model, part.world_from_object, sphere_of(objects, k)};
    spheres.push_back(places_[k].sphere);
  }
  return spheres;
}

/// Each object with the first before it that is near enough, else alone.
std::vector<ObjectMaps::Group> ObjectMaps::groups(const VirtualObjects& objects) const {
  std::vector<Group> groups;
  for (std::size_t k = 0; k < places_.size(); ++k) {
    const Gloss own = gloss_of(objects.parts[k].mesh());
    if (!own.any())
      continue;
    const BoundingSphere& sphere = places_[k].sphere;
    auto near = std::ranges::find_if(groups, [&](const Group& g) {
      return glm::distance(g.sphere.centre, sphere.centre) < kShared * std::max(g.sphere.radius, sphere.radius);
    });
    if (near == groups.end())
      near = groups.insert(groups.end(), Group{{}, sphere, own.least, own.most});
    near->parts.push_back(k);
    join(near->sphere, sphere);
    near->least_roughness = std::min(near->least_roughness, own.least);
    near->most_roughness = std::max(near->most_roughness, own.most);
  }
  return groups;
}

/// A map whose objects are the same is kept; it is traced anew where one of them moved.
Result<void> ObjectMaps::arrange(const VirtualObjects& objects, std::span<const std::uint8_t> moved) {
  std::vector<Surroundings> arranged;
  for (const Group& g : groups(objects)) {
    const auto old = std::ranges::find(all_, g.parts, &Surroundings::parts);
    if (old != all_.end()) {
      arranged.push_back(std::move(*old));
      if (std::ranges::any_of(g.parts, [&](std::size_t k) { return moved[k] != 0; }))
        arranged.back().is_traced = false;
      arranged.back().sphere = g.sphere;
      continue;
    }
    auto map = EnvironmentMap::create(settings_for({g.least_roughness, g.most_roughness}));
    if (!map)
      return map.error();
    const int side = map->sharp().side;
    arranged.push_back({g.parts, g.sphere, std::move(*map), RadianceMap(side), false});
  }
  all_ = std::move(arranged);
  return {};
}

Result<ObjectMaps::Counts> ObjectMaps::update(const RoomSeen& room, const GlossyRays& rays, bool all_changed) {
  std::vector<std::uint8_t> moved;
  const std::vector<BoundingSphere> spheres = moved_from_and_to(room.objects.objects(), moved);
  if (!spheres.empty())
    if (const auto arranged = arrange(room.objects.objects(), moved); !arranged)
      return arranged.error();
  Counts counts;
  for (Surroundings& s : all_) {
    const auto texels = all_changed || !s.is_traced ? every_texel(s) : texels_towards(s, spheres);
    if (texels.empty())
      continue;
    if (const auto traced = trace(room, rays, texels, s); !traced)
      return traced.error();
    ++counts.maps;
    counts.texels += texels.size();
  }
  return counts;
}

/// Null: by rays.
const Surroundings* GlossyRays::surroundings(const ObjectPoint& point, const Surface& s) const {
  const bool mapped = settings_.maps && by_map(s.material.transmission, s.material.lobe.has_value());
  return mapped ? settings_.maps->of(point.part) : nullptr;
}

/// What the coat mirrors and what is below it, each about the mirror direction.
Rgb GlossyRays::looked_up(const Surroundings& around, const ObjectPoint& point, const Surface& s) {
  const glm::vec3 mirrored = s.to_world({-s.out.x, -s.out.y, s.out.z});
  const auto seen = [&](float alpha) { return around.radiance(point.position, mirrored, alpha); };
  const SurfaceMaterial& m = s.material;
  const float coat = m.clearcoat > 0.0f ? m.clearcoat * fresnel_dielectric(s.out.z, Bsdf::kCoatIor) : 0.0f;
  const Rgb below = glm::max(s.bsdf.reflected_albedo(s.out) - coat, Rgb(0.0f));
  return below * seen(std::sqrt(m.alpha_u * m.alpha_v)) + (coat > 0.0f ? coat * seen(m.clearcoat_alpha) : Rgb(0.0f));
}

} // namespace daylit
