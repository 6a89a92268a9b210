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

constexpr double kOutside = 1.001;  // radii from the centre: there rays have left the object
constexpr double kReach = 2.0;      // radii around an object that moved: itself, and its shadow where that is darkest
constexpr int kSteps = 3;           // from a distance to the next
constexpr double kSharpest = 0.1;   // roughness; below, no blurred map is needed

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
    for (std::size_t k = 0; k < texels.size(); ++k) {
      room[k].ray = {around_.sphere.centre, glm::vec3(radiance.direction(texels[k]))};
      room[k].width_rad = width_rad_;
    }
    room_.find_ends({room.data(), texels.size()});
    std::array<std::optional<ObjectPoint>, kRayBatch> others;
    find_others({room.data(), texels.size()}, others);
    std::array<std::uint32_t, kRayBatch> texel;
    std::size_t kept = 0;
    for (std::size_t k = 0; k < texels.size(); ++k) {
      if (others[k]) {
        const WorldRay ray = outside(room[k].ray);
        rays_.radiance({&ray, 1}, {&radiance.radiance[texels[k]], 1}, width_rad_);
        nearness.radiance[texels[k]] = Rgb(static_cast<float>(1.0 / (start_m_ + others[k]->distance)));
        continue;
      }
      nearness.radiance[texels[k]] = Rgb(room[k].end ? static_cast<float>(1.0 / room[k].end->distance) : 0.0f);
      texel[kept] = texels[k];
      room[kept++] = room[k];
    }
    room_.find_radiance({room.data(), kept});
    for (std::size_t k = 0; k < kept; ++k)
      radiance.radiance[texel[k]] = room[k].radiance;
  }

private:
  WorldRay outside(const WorldRay& ray) const {
    return {ray.origin + start_m_ * glm::dvec3(ray.direction), ray.direction};
  }
  /// Objects that stand before what of the room the rays meet.
  void find_others(std::span<const RoomRay> room, std::span<std::optional<ObjectPoint>> others) const {
    std::array<WorldRay, kRayBatch> rays;
    std::array<double, kRayBatch> most;
    for (std::size_t k = 0; k < room.size(); ++k) {
      rays[k] = outside(room[k].ray);
      most[k] =
          room[k].end ? std::max(room[k].end->distance - start_m_, 0.0) : std::numeric_limits<double>::infinity();
    }
    room_.objects.closest({rays.data(), room.size()}, most, others);
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

/// The point where the ray meets the sphere of a radius around the centre, and the radius there from the map, in turns.
Rgb Surroundings::radiance(const glm::dvec3& x, const glm::vec3& direction, double exponent) const {
  const glm::dvec3 from = x - sphere.centre, d(direction);
  const double along = glm::dot(from, d), aside2 = glm::dot(from, from) - along * along;
  glm::dvec3 seen = d;
  for (int step = 0; step < kSteps; ++step) {
    const double near = static_cast<double>(nearness.lookup(glm::vec3(seen)).r);
    const double radius = 1.0 / std::max(near, 1e-3);
    seen = from + (std::sqrt(std::max(radius * radius - aside2, 0.0)) - along) * d;
  }
  return map.lookup(glm::vec3(seen), exponent);
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

/// A map whose objects are the same is kept; it is traced anew where one of them moved.
Result<void> ObjectMaps::group(const VirtualObjects& objects, std::span<const std::uint8_t> moved) {
  std::vector<Surroundings> groups;
  std::vector<Gloss> gloss;
  for (std::size_t k = 0; k < places_.size(); ++k) {
    const Gloss own = gloss_of(objects.parts[k].mesh());
    if (!own.any())
      continue;
    const BoundingSphere& sphere = places_[k].sphere;
    auto near = std::ranges::find_if(groups, [&](const Surroundings& g) {
      return glm::distance(g.sphere.centre, sphere.centre) < kShared * std::max(g.sphere.radius, sphere.radius);
    });
    if (near == groups.end()) {
      groups.push_back({{k}, sphere, {}, {}, false});
      gloss.push_back(own);
      continue;
    }
    near->parts.push_back(k);
    join(near->sphere, sphere);
    Gloss& joint = gloss[static_cast<std::size_t>(near - groups.begin())];
    joint.include(own.least);
    joint.include(own.most);
  }
  for (std::size_t g = 0; g < groups.size(); ++g) {
    Surroundings& s = groups[g];
    const auto old = std::ranges::find(all_, s.parts, &Surroundings::parts);
    if (old != all_.end()) {
      old->is_traced = std::ranges::none_of(s.parts, [&](std::size_t k) { return moved[k] != 0; });
      old->sphere = s.sphere;
      s = std::move(*old);
      continue;
    }
    auto map = EnvironmentMap::create(settings_for(gloss[g]));
    if (!map)
      return map.error();
    s.map = std::move(*map);
    s.nearness = RadianceMap(s.map.sharp().side);
  }
  all_ = std::move(groups);
  return {};
}

Result<ObjectMaps::Counts> ObjectMaps::update(const RoomSeen& room, const GlossyRays& rays, bool all_changed) {
  std::vector<std::uint8_t> moved;
  const std::vector<BoundingSphere> spheres = moved_from_and_to(room.objects.objects(), moved);
  if (!spheres.empty())
    if (const auto grouped = group(room.objects.objects(), moved); !grouped)
      return grouped.error();
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
  const auto seen = [&](float alpha) {
    return around.radiance(point.position, mirrored, phong_exponent(std::sqrt(static_cast<double>(alpha))));
  };
  const SurfaceMaterial& m = s.material;
  const float coat = m.clearcoat > 0.0f ? m.clearcoat * fresnel_dielectric(s.out.z, Bsdf::kCoatIor) : 0.0f;
  const Rgb below = glm::max(s.bsdf.reflected_albedo(s.out) - coat, Rgb(0.0f));
  return below * seen(std::sqrt(m.alpha_u * m.alpha_v)) + (coat > 0.0f ? coat * seen(m.clearcoat_alpha) : Rgb(0.0f));
}

} // namespace daylit
