#pragma once

// What glossy objects see around them, kept in a map each (runtime/maps): in the place of rays one look-up for each
// lobe of a pixel. A map is right at the place that it is seen from; elsewhere on the object the look-up is turned to
// where its ray ends, by the distances that the map keeps (Szirmay-Kalos et al. 2005, "Approximate ray-tracing on the
// GPU with distance impostors").

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/base/bounding_sphere.h"
#include "runtime/maps/environment_map.h"
#include "runtime/reflect/glossy_rays.h"

namespace daylit {

/// What is around an object, or around some that stand within one another, without themselves.
struct Surroundings {
  std::vector<std::size_t> parts; ///< of the objects, ascending
  BoundingSphere sphere;          ///< around their vertices, world; all is seen from its centre
  EnvironmentMap map;
  RadianceMap nearness; ///< in each channel: 1 / distance of what is seen, per metre; of the sky 0
  bool is_traced = false;

  /// Mean radiance under a lobe about a unit direction, from world point x of the objects. `alpha`: slope of the facets
  /// (GGX), roughness squared; below kWideAlpha of the direction alone.
  Rgb radiance(const glm::dvec3& x, const glm::vec3& direction, float alpha) const;

private:
  glm::dvec3 end_of_ray(const glm::dvec3& from, const glm::dvec3& direction) const;
};

/// The maps of all objects that mirror and are not of glass.
class ObjectMaps {
public:
  static constexpr int kMostSide = 256; ///< texels, of a mirror's map: 0.8 degrees a texel
  /// Objects share a map where their centres are nearer than this part of the larger one's radius.
  static constexpr double kShared = 0.5;

  struct Counts {
    std::size_t maps = 0;     ///< made or renewed
    std::uint64_t texels = 0; ///< traced
  };
  /// Traces what changed: all where `all_changed` (room, light, photograph or camera), else the maps of objects that
  /// moved, and of the others what lies within two radii of these, before and now. A shadow that falls further is
  /// renewed when all is. `rays`: without maps. Error: radiance that is not finite; the map is then as before.
  Result<Counts> update(const RoomSeen& room, const GlossyRays& rays, bool all_changed);
  /// Null where an object has none.
  const Surroundings* of(std::size_t part) const;

private:
  /// Where an object is.
  struct Place {
    std::shared_ptr<const VirtualObjects::Model> model;
    glm::dmat4 world_from_object{1.0};
    BoundingSphere sphere;
  };
  /// Objects that share a map.
  struct Group {
    std::vector<std::size_t> parts;
    BoundingSphere sphere;
    double least_roughness = 1.0, most_roughness = 0.0; ///< of what mirrors
  };
  std::vector<Group> groups(const VirtualObjects& objects) const;
  Result<void> arrange(const VirtualObjects& objects, std::span<const std::uint8_t> moved);
  std::vector<BoundingSphere> moved_from_and_to(const VirtualObjects& objects, std::vector<std::uint8_t>& moved);

  std::vector<Place> places_; ///< of each object, at the last update
  std::vector<Surroundings> all_;
};

} // namespace daylit
