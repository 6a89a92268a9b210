#include "runtime/indirect/receiver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "runtime/base/orthonormal.h"
#include "runtime/sky/window_sampler.h"

namespace daylit {

namespace {
constexpr double kSkin = 0.01; // of an object's radius: its own facets cast no shadow closer than this
} // namespace

/// Directions with the same patch behind them are summed: it is looked up once per light.
void LitScene::trace(const glm::dvec3& x, const glm::dvec3& n, const DirectionPattern& pattern,
                     Receiver& receiver) const {
  std::vector<OccludedDirection> occluded;
  find_occluded(rays, patches, parts, x, n, pattern, occluded);
  receiver.senders.clear();
  receiver.hidden.clear();
  for (const OccludedDirection& d : occluded) {
    const PartHit& o = d.object;
    receiver.senders.push_back({o.vertex, d.weight * glm::vec3(1.0f - o.u - o.v, o.u, o.v), o.back});
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

/// sum over the occluded directions of cos dw L_object.
Rgb LitScene::sent_irradiance(const Receiver& receiver) const {
  Rgb sum(0.0f);
  for (const Receiver::Sender& s : receiver.senders)
    for (int k = 0; k < 3; ++k) {
      const TwoSided& vertex = radiance[s.vertex[static_cast<std::size_t>(k)]];
      sum += s.weight[k] * (s.back ? vertex.back : vertex.front);
    }
  return sum;
}

/// sum over the occluded directions of cos dw rho E / pi of the patch behind (Grosch et al. 2007 leave this term out),
/// and what the sunlit points behind send.
Rgb LitScene::hidden_irradiance(const Receiver& receiver, const glm::dvec3& x, const glm::dvec3& n) const {
  Rgb sum = hidden_sunlight(x + kAirGap_m * n, n);
  for (const Receiver::Hidden& h : receiver.hidden)
    sum += h.weight * h.patch->reflectance * patches.irradiance(*h.patch) * std::numbers::inv_pi_v<float>;
  return sum;
}

/// sum over the points of power / pi cos cos' / r^2 (a small diffuse source), where an object and none of the room
/// stands between.
Rgb LitScene::hidden_sunlight(const glm::dvec3& x, const glm::dvec3& n) const {
  constexpr std::size_t kPacket = 16;
  Rgb sum(0.0f);
  std::array<glm::dvec3, kPacket> offset, direction;
  std::array<Rgb, kPacket> arriving;
  std::size_t count = 0;
  const auto add_hidden = [&] {
    std::uint32_t hidden = parts.occluded(x, {direction.data(), count});
    hidden = hidden ? hidden & windows.past_room(x, {offset.data(), count}) : 0u;
    for (std::size_t k = 0; k < count; ++k)
      if (hidden >> k & 1u)
        sum += arriving[k];
    count = 0;
  };
  for (const SunlitPoint& p : sunlit) {
    const glm::dvec3 d = p.position - x;
    const double here = glm::dot(n, d), there = -glm::dot(p.normal, d), r2 = glm::dot(d, d);
    if (here <= 0.0 || there <= 0.0)
      continue;
    offset[count] = d;
    direction[count] = d / std::sqrt(r2);
    arriving[count++] = static_cast<float>(here * there / (std::numbers::pi * r2 * r2)) * p.power;
    if (count == kPacket)
      add_hidden();
  }
  if (count > 0)
    add_hidden();
  return sum;
}

/// E = E_indirect + V_window E_sky.
Rgb LitScene::before(const Receiver& receiver, std::uint32_t triangle, const glm::dvec3& x,
                     const glm::dvec3& direction) const {
  const RoomPoint point = light.at_surface(triangle, x, direction);
  return point.indirect_irradiance + *receiver.window_visibility * point.open_sky_irradiance;
}

/// V_blocked E_sky + the mean of the sun's loss.
Rgb LitScene::lost_direct(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& n, double width) const {
  constexpr int kSunPoints = 4;
  const glm::dvec3 air = x + kAirGap_m * n;
  Rgb sun(0.0f);
  if (windows.has_sun()) {
    const OrthonormalBasis plane(n);
    for (int k = 0; k < kSunPoints; ++k) {
      const glm::dvec2 u = width * (lattice_point(k, kSunPoints) - 0.5);
      sun += windows.lost_sun(air + u.x * plane.u + u.y * plane.v, n, parts) / static_cast<float>(kSunPoints);
    }
  }
  return windows.blocked_fraction(air, n, parts) * light.at_surface(triangle, x, -n).open_sky_irradiance + sun;
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
