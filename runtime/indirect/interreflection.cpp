#include "runtime/indirect/interreflection.h"

namespace daylit {

namespace {
constexpr double kSeenRadii = 2.5; // a change further from an object is not looked for,
constexpr double kFarRadii = 4.0;  // nor by a point further away
} // namespace

std::vector<ChangedSurface> find_changed_surfaces(const LitScene& scene, const glm::dvec3& x, const glm::dvec3& n,
                                                  const DirectionPattern& pattern, const LinkTo& link) {
  std::vector<ChangedSurface> surfaces;
  if (scene.radii_away(x) > kFarRadii)
    return surfaces;
  const auto each = 1.0f / static_cast<float>(pattern.points().size());
  look_around(scene.rays, x, n, pattern, [&](std::uint32_t triangle, const glm::dvec3& position, const glm::dvec3& w) {
    if (scene.radii_away(position) > kSeenRadii || scene.parts.between(x, position))
      return;
    const double away = glm::length(position - x) / scene.parts.smallest_radius();
    surfaces.push_back({each * scene.reflectance(triangle), link(triangle, position, w, away)});
  });
  return surfaces;
}

LampView look_at_lamps(const LitScene& scene, const glm::dvec3& x, const glm::dvec3& n,
                       const DirectionPattern& pattern) {
  if (!scene.lamps.any())
    return {};
  const bool near = scene.radii_away(x) <= kFarRadii;
  return scene.lamps.look(x, n, pattern,
                          [&](const glm::dvec3& seen) { return near && scene.radii_away(seen) <= kSeenRadii; });
}

} // namespace daylit
