#include "runtime/depth/thing_light.h"

#include <algorithm>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/indirect/room_planes.h"

namespace daylit {

namespace {

constexpr double kFar_m = std::numeric_limits<double>::infinity();

/// Irradiance of directional lights: through the panes, past the room, past the objects too.
struct Received {
  Rgb open{0.0f}, past_room{0.0f}, past_both{0.0f};
};

/// The quotient, 0 where nothing is divided.
Rgb fraction(const Rgb& part, const Rgb& whole) {
  Rgb f(0.0f);
  for (int c = 0; c < 3; ++c)
    f[c] = whole[c] > 0.0f ? part[c] / whole[c] : 0.0f;
  return f;
}

/// e = irradiance max(0, n.w) T.
Received received(const ThingLight& l, std::span<const DirectionalLight> lights, const glm::dvec3& x,
                  const glm::dvec3& n) {
  Received sum;
  for (const DirectionalLight& light : lights) {
    const double cosine = glm::dot(n, light.direction);
    if (cosine <= 0.0)
      continue;
    const ApertureCrossings::Met pane = l.windows.met(x, light.direction, kFar_m);
    if (pane.count == 0)
      continue;
    const Rgb e = static_cast<float>(cosine) * light.irradiance * pane.transmittance;
    sum.open += e;
    const glm::vec3 direction(light.direction);
    if (l.rays.occluded(l.rays.to_local(x), direction, 0.0f, std::numeric_limits<float>::infinity()))
      continue;
    sum.past_room += e;
    sum.past_both += e * l.objects.transmittance({x, direction}, kFar_m);
  }
  return sum;
}

/// An object stands before some light, whatever the room does.
bool loses_any(const ThingLight& l, const glm::dvec3& x, const glm::dvec3& n) {
  for (const auto* lights : {&l.lights.sky, &l.lights.sun})
    for (const DirectionalLight& light : *lights)
      if (glm::dot(n, light.direction) > 0.0 && l.objects.closest({x, glm::vec3(light.direction)}, kFar_m))
        return true;
  return false;
}

} // namespace

/// (E - lost) / E, E = E_open sky x received / open + E_sun + E_indirect: as the room's own, with the samples deciding
/// only which part of the sky is lost (runtime/sky/direct_light.h).
Rgb ThingLight::ratio(const ThingPoint& point) const {
  const glm::dvec3 x = point.position + kAirGap_m * point.normal;
  if (!loses_any(*this, x, point.normal)) // most points: no ray into the room is needed
    return Rgb(1.0f);
  const Received sky = received(*this, lights.sky, x, point.normal), sun = received(*this, lights.sun, x, point.normal);
  if (sky.past_room == sky.past_both && sun.past_room == sun.past_both)
    return Rgb(1.0f);
  const Rgb open_sky = open_sky_irradiance(pyramid, cells, x, point.normal);
  const Rgb before = open_sky * fraction(sky.past_room, sky.open) + sun.past_room +
                     light.indirect_irradiance(point.normal, light.probes_at(x));
  const Rgb lost = open_sky * fraction(sky.past_room - sky.past_both, sky.open) + sun.past_room - sun.past_both;
  return glm::clamp(Rgb(1.0f) - fraction(lost, before), 0.0f, 1.0f);
}

} // namespace daylit
