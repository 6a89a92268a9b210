#include "runtime/indirect/receiver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "runtime/sky/window_sampler.h"
#include "scene/core/orthonormal.h"

namespace daylit {

namespace {
constexpr double kSkin = 0.01; // of an object's radius: its own facets cast no shadow closer than this
constexpr float kLeastApart = 0.2f, kWholeApart = 0.4f; // logarithm of what the two differ by, from which on it is
constexpr double kSameSun = 0.999994;                   // cosine of a fifth of a degree
constexpr float kLeastGain = 0.05f, kWholeGain = 0.15f; // of the light before, from which on it is scaled
constexpr float kMostScale = 2.0f;                      // of what is hidden, to agree with the volume

/// One entry for each side. Weights are added in the order in which they stand.
void merge(std::vector<Receiver::Sender>& senders) {
  std::ranges::stable_sort(senders, {}, &Receiver::Sender::side);
  std::size_t count = 0;
  for (const Receiver::Sender& s : senders)
    if (count > 0 && senders[count - 1].side == s.side)
      senders[count - 1].weight += s.weight;
    else
      senders[count++] = s;
  senders.resize(count);
  senders.shrink_to_fit();
}

void add(const OccludedDirection& d, Receiver::View& view) {
  const PartHit& o = d.object;
  const float corner[3] = {1.0f - o.u - o.v, o.u, o.v};
  for (std::size_t k = 0; k < 3; ++k)
    view.senders.push_back({2 * o.vertex[k] + o.back, d.weight * corner[k]});
  if (o.mirrored != glm::vec3(0.0f))
    view.mirrors.push_back({2 * o.vertex[std::ranges::max_element(corner) - corner] + o.back, d.weight,
                            MirroredLight::direction_of(o.mirrored)});
  if (d.behind)
    add_patch(view.hidden, d.behind, d.weight);
}

} // namespace

void LitScene::trace(const glm::dvec3& x, const glm::dvec3& n, const DirectionPattern& pattern, Receiver& receiver,
                     const std::function<bool(std::size_t)>& holds) const {
  receiver.views.resize(parts.size());
  std::vector<OccludedDirection> occluded;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    if (holds && holds(part))
      continue;
    Receiver::View& view = receiver.views[part] = {};
    occluded.clear();
    find_occluded(rays, patches, parts, part, x, n, pattern, occluded);
    for (const OccludedDirection& d : occluded)
      add(d, view);
    merge(view.senders);
  }
  receiver.surrounded = surrounded(parts, x);
  if (receiver.surrounded > 0.0f && receiver.around.empty())
    receiver.around = find_around(rays, patches, x, n, pattern);
  if (!receiver.window_visibility)
    receiver.window_visibility = windows.visible_fraction(x, n);
}

/// sum over the occluded directions of cos dw L_object.
Rgb LitScene::sent_irradiance(const Receiver& receiver) const {
  Rgb sum(0.0f);
  for (const Receiver::View& view : receiver.views)
    for (const Receiver::Sender& s : view.senders) {
      const TwoSided& vertex = radiance[s.side / 2];
      sum += s.weight * (s.side % 2 == 0 ? vertex.front : vertex.back);
    }
  return sum;
}

/// sum over the directions in which an object mirrors of cos dw Delta L.
Rgb LitScene::mirrored_irradiance(const Receiver& receiver) const {
  Rgb sum(0.0f);
  if (mirrored.any())
    for (const Receiver::View& view : receiver.views)
      for (const Receiver::Mirror& m : view.mirrors)
        sum += m.weight * mirrored.change(m.side, m.from);
  return sum;
}

/// E / E'
Rgb agreement(const Rgb& volume, const Rgb& all) {
  Rgb scale(1.0f);
  for (int c = 0; c < 3; ++c)
    if (all[c] > 0.0f)
      scale[c] = std::clamp(volume[c] / all[c], 1.0f / kMostScale, kMostScale);
  return scale;
}

/// sum of cos dw rho E / pi
Rgb LitScene::sent_by_patches(std::span<const SeenPatch> seen) const {
  Rgb sum(0.0f);
  for (const SeenPatch& s : seen)
    sum += s.weight * s.patch->reflectance * patches.irradiance(*s.patch) * std::numbers::inv_pi_v<float>;
  return sum;
}

/// H = sum over the occluded directions of cos dw rho E / pi of the patch behind (Grosch et al. 2007 leave this term
/// out), and what the sunlit points behind send. Where an object hides most of the light, H E / E', E' the same sum as
/// H over all directions.
Rgb LitScene::hidden_irradiance(const Receiver& receiver, const RoomPoint& here, const glm::dvec3& x,
                                const glm::dvec3& n) const {
  const Sunlight sunlight = sent_by_sunlit(x + kAirGap_m * n, n, receiver.surrounded > 0.0f);
  Rgb hidden = sunlight.hidden;
  for (const Receiver::View& view : receiver.views)
    hidden += sent_by_patches(view.hidden);
  if (receiver.surrounded == 0.0f)
    return hidden;
  const Rgb scale = agreement(here.indirect_irradiance, sunlight.all + sent_by_patches(receiver.around));
  return glm::mix(Rgb(1.0f), scale, receiver.surrounded) * hidden;
}

/// sum over the points of power / pi cos cos' / r^2 (a small diffuse source), where none of the room stands between;
/// hidden: where an object does.
LitScene::Sunlight LitScene::sent_by_sunlit(const glm::dvec3& x, const glm::dvec3& n, bool all) const {
  constexpr std::size_t kPacket = 16;
  Sunlight sum;
  std::array<glm::dvec3, kPacket> offset, direction;
  std::array<Rgb, kPacket> arriving;
  std::size_t count = 0;
  const auto add = [&] {
    const std::uint32_t behind = parts.occluded(x, {direction.data(), count}),
                        seen = all || behind ? windows.past_room(x, {offset.data(), count}) : 0u;
    for (std::size_t k = 0; k < count; ++k) {
      if (all && seen >> k & 1u)
        sum.all += arriving[k];
      if (seen & behind & 1u << k && parts.between(x, x + offset[k])) // not beyond the point, behind a wall
        sum.hidden += arriving[k];
    }
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
      add();
  }
  if (count > 0)
    add();
  return sum;
}

/// sum over the directions of cos dw rho E / pi, E with the sun's.
Rgb LitScene::sent_by_room(const glm::dvec3& x, const glm::dvec3& n, const DirectionPattern& pattern) const {
  Rgb sum(0.0f);
  look_around(rays, x, n, pattern, [&](std::uint32_t triangle, const glm::dvec3& seen, const glm::dvec3& w) {
    RoomPatch* patch = patches.at(triangle, seen, w);
    const glm::dvec3& there = normal_of(triangle, w);
    sum += patch->reflectance * (patches.irradiance(*patch) + windows.sun_sample(0, seen + kAirGap_m * there, there));
  });
  return sum / static_cast<float>(pattern.points().size());
}

/// (E + V E_sky) / (E' + V E_sky), E' by the directions of the pattern, but for the sun's, which few of them would
/// meet: by the sunlit points.
Rgb LitScene::gain_scale(const Rgb& gain, const Rgb& before, const RoomPoint& here, const glm::dvec3& x,
                         const glm::dvec3& n, const DirectionPattern& pattern, Receiver& receiver) const {
  const float share = luminance(gain) / std::max(luminance(before), std::numeric_limits<float>::min());
  const float t = std::clamp((share - kLeastGain) / (kWholeGain - kLeastGain), 0.0f, 1.0f);
  if (!windows.has_sun() || t == 0.0f)
    return Rgb(1.0f);
  const glm::dvec3 air = x + kAirGap_m * n;
  if (receiver.around.empty())
    receiver.around = find_around(rays, patches, air, n, pattern);
  const Rgb sun = glm::max(windows.sun_normal_irradiance(), Rgb(std::numeric_limits<float>::min()));
  if (glm::dot(receiver.sun, windows.sun_direction()) < kSameSun) {
    receiver.sun = windows.sun_direction();
    receiver.of_sun = sent_by_sunlit(air, n, true).all / sun;
  }
  const Rgb sent = receiver.of_sun * sun + sent_by_patches(receiver.around);
  const Rgb all = sent + (before - here.indirect_irradiance);
  const float apart = std::fabs(std::log(std::max(luminance(all), 1e-30f) / std::max(luminance(before), 1e-30f)));
  const float u = std::clamp((apart - kLeastApart) / (kWholeApart - kLeastApart), 0.0f, 1.0f);
  return glm::mix(Rgb(1.0f), agreement(before, all), t * u);
}

/// E = E_indirect + V_window E_sky.
Rgb LitScene::before(const Receiver& receiver, const RoomPoint& here) {
  return here.indirect_irradiance + *receiver.window_visibility * here.open_sky_irradiance;
}

Rgb LitScene::lost_sun(const glm::dvec3& x, const glm::dvec3& n, double width, int points) const {
  const glm::dvec3 air = x + kAirGap_m * n;
  Rgb sun(0.0f);
  if (windows.has_sun()) {
    const OrthonormalBasis plane(n);
    for (int k = 0; k < points; ++k) {
      const glm::dvec2 u = width * (lattice_point(k, points) - 0.5);
      sun += windows.lost_sun(air + u.x * plane.u + u.y * plane.v, n, parts) / static_cast<float>(points);
    }
  }
  return sun;
}

/// rho / pi E_sun(x, n) V, by one sample of the disc: L of a diffuse surface.
Rgb LitScene::reflected_sun(const glm::dvec3& x, const glm::dvec3& n, const Rgb& reflectance) const {
  const Rgb irradiance = windows.sun_sample(0, x + kAirGap_m * n, n);
  if (irradiance == Rgb(0.0f))
    return irradiance;
  double skin = kAirGap_m;
  for (std::size_t k = 0; k < parts.size(); ++k)
    skin = std::max(skin, kSkin * parts.sphere(k).radius);
  return parts.passed(x + skin * n, windows.sun_direction()) * reflectance * irradiance * std::numbers::inv_pi_v<float>;
}

/// min over the objects of |x - c| / r.
double LitScene::radii_away(const glm::dvec3& x) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < parts.size(); ++k)
    nearest = std::min(nearest, glm::length(x - parts.sphere(k).centre) / std::max(parts.sphere(k).radius, 1e-9));
  return nearest;
}

/// 1 + min over the objects of (|x - c| - r) / r_smallest.
double LitScene::smallest_radii_away(const glm::dvec3& x) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < parts.size(); ++k)
    nearest = std::min(nearest, glm::length(x - parts.sphere(k).centre) - parts.sphere(k).radius);
  return 1.0 + nearest / parts.smallest_radius();
}

} // namespace daylit
