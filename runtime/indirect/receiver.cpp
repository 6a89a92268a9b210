#include "runtime/indirect/receiver.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>

namespace daylit {

namespace {
constexpr double kSkin = 0.01; // of an object's radius: its own facets cast no shadow closer than this
} // namespace

/// Directions with the same patch behind them are summed: it is looked up once per light.
void LitScene::trace(const glm::dvec3& x, const glm::dvec3& n, const DirectionPattern& pattern,
                     Receiver& receiver) const {
  receiver.occluded.clear();
  find_occluded(rays, patches, parts, x, n, pattern, receiver.occluded);
  receiver.hidden.clear();
  for (const OccludedDirection& d : receiver.occluded) {
    if (!d.behind)
      continue;
    auto same = std::find_if(receiver.hidden.begin(), receiver.hidden.end(),
                             [&](const Receiver::Hidden& h) { return h.patch == d.behind; });
    if (same == receiver.hidden.end())
      same = receiver.hidden.insert(same, {d.behind, 0.0f});
    same->weight += d.weight;
  }
  if (!receiver.window_visibility)
    receiver.window_visibility = windows.visible_fraction(x, n);
}

/// Delta E = sum over the occluded directions of cos dw (L_object - L_behind) (Grosch et al. 2007 leave this term out).
/// L_behind = rho E / pi of the patch there, and its sun, which is looked up in each direction: its edges are sharp.
/// E before = E_indirect + V_window E_sky.
IndirectChange LitScene::change(const Receiver& receiver, std::uint32_t triangle, const glm::dvec3& x,
                                const glm::dvec3& direction) const {
  IndirectChange change;
  for (std::size_t k = 0; k < receiver.occluded.size(); ++k) {
    const OccludedDirection& d = receiver.occluded[k];
    change.irradiance += d.weight * (object_radiance(d, radiance) - sunlight_behind(d, k, windows));
  }
  for (const Receiver::Hidden& h : receiver.hidden)
    change.irradiance -= h.weight * h.patch->reflectance * patches.irradiance(*h.patch) * std::numbers::inv_pi_v<float>;
  const RoomPoint point = light.at_surface(triangle, x, direction);
  change.before = point.indirect_irradiance + *receiver.window_visibility * point.open_sky_irradiance;
  return change;
}

/// rho / pi E_sun(x, n) V, by one sample of the disc: L of a diffuse surface.
Rgb LitScene::reflected_sun(const glm::dvec3& x, const glm::dvec3& n, const Rgb& reflectance) const {
  const Rgb irradiance = windows.sun_sample(0, x + kAirGap_m * n, n);
  if (irradiance == Rgb(0.0f))
    return irradiance;
  double skin = kAirGap_m;
  for (std::size_t k = 0; k < parts.size(); ++k)
    skin = std::max(skin, kSkin * parts.sphere(k).radius);
  if (parts.occluded(x + skin * n, windows.sun_direction()))
    return Rgb(0.0f);
  return reflectance * irradiance * std::numbers::inv_pi_v<float>;
}

/// min over the objects of |x - c| / r.
double LitScene::radii_away(const glm::dvec3& x) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < parts.size(); ++k)
    nearest = std::min(nearest, glm::length(x - parts.sphere(k).centre) / std::max(parts.sphere(k).radius, 1e-9));
  return nearest;
}

} // namespace daylit
