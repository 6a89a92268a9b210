#include "runtime/reflect/room_seen.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "runtime/depth/depth_walk.h"

namespace daylit {

namespace {
// Seen at a flatter angle, a pixel of the photograph stands for too long a piece of the surface.
constexpr double kFlattest = 0.05; // cosine
constexpr float kInfinity = std::numeric_limits<float>::infinity();
} // namespace

PhotographedRoom::PhotographedRoom(const Composite& composite, const RenderCamera& camera, const LensModel& lens,
                                   const PhotoScale& scale, float white)
    : composite_(composite), camera_(camera), lens_(lens),
      camera_from_world_(glm::transpose(glm::dmat3(camera.world_from_camera))),
      radiance_from_photo_(glm::inverse(scale.scale * scale.colour_matrix)),
      scale_x_(lens.width_px > 0 ? static_cast<double>(camera.photo_width_px) / lens.width_px : 1.0),
      scale_y_(lens.height_px > 0 ? static_cast<double>(camera.photo_height_px) / lens.height_px : 1.0), white_(white) {
}

/// In the picture, where there are pixels on all sides to interpolate between.
std::optional<glm::dvec2> PhotographedRoom::pixel_of(const glm::dvec3& x) const {
  const auto at = lens_.project(camera_from_world_ * (x - camera_.eye()));
  if (!at)
    return std::nullopt;
  const double px = (at->x + 0.5) * scale_x_ - 0.5, py = (at->y + 0.5) * scale_y_ - 0.5;
  if (camera_.photo_width_px < 2 || camera_.photo_height_px < 2)
    return std::nullopt;
  if (!(px >= 0.0 && py >= 0.0 && px <= camera_.photo_width_px - 1 && py <= camera_.photo_height_px - 1))
    return std::nullopt;
  return glm::dvec2(px, py);
}

/// Not covered by an object, and not white.
bool PhotographedRoom::is_known(std::size_t i) const {
  const Rgb& pixel = composite_.picture.texels[i];
  return composite_.coverage[i] <= 0.0f && std::max({pixel.r, pixel.g, pixel.b}) < white_;
}

Rgb PhotographedRoom::from_photo(const Rgb& value) const {
  return glm::max(Rgb(radiance_from_photo_ * glm::dvec3(value)), Rgb(0.0f));
}

std::optional<Rgb> PhotographedRoom::radiance(const glm::dvec3& x) const {
  const auto p = pixel_of(x);
  if (!p)
    return std::nullopt;
  const int x0 = std::min(static_cast<int>(p->x), camera_.photo_width_px - 2),
            y0 = std::min(static_cast<int>(p->y), camera_.photo_height_px - 2);
  const auto s = static_cast<float>(p->x - x0), t = static_cast<float>(p->y - y0);
  const std::size_t first = static_cast<std::size_t>(y0) * camera_.photo_width_px + x0;
  const std::size_t four[4] = {first, first + 1, first + camera_.photo_width_px, first + camera_.photo_width_px + 1};
  const float weight[4] = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
  Rgb sum(0.0f);
  for (int k = 0; k < 4; ++k) {
    if (!is_known(four[k]))
      return std::nullopt;
    sum += weight[k] * composite_.picture.texels[four[k]];
  }
  return from_photo(sum);
}

std::optional<Rgb> PhotographedRoom::nearest(const glm::dvec3& x) const {
  const auto p = pixel_of(x);
  if (!p)
    return std::nullopt;
  const std::size_t i = static_cast<std::size_t>(p->y + 0.5) * static_cast<std::size_t>(camera_.photo_width_px) +
                        static_cast<std::size_t>(p->x + 0.5);
  return is_known(i) ? std::optional(from_photo(composite_.picture.texels[i])) : std::nullopt;
}

std::optional<RoomSeen::Hit> RoomSeen::closest(const WorldRay& ray) const {
  RayHit hit;
  std::optional<Hit> met;
  if (rays.closest(rays.to_local(ray.origin), ray.direction, 0.0f, kInfinity, hit))
    met = Hit{hit.triangle, static_cast<double>(hit.distance)};
  return things ? thing_before(ray, met) : met;
}

std::optional<RoomSeen::Hit> RoomSeen::thing_before(const WorldRay& ray, const std::optional<Hit>& met) const {
  const auto distance = first_thing(*things, ray, met ? met->distance : std::numeric_limits<double>::infinity());
  return distance && thing_radiance(ray, *distance) ? Hit{kUnknownTriangle, *distance} : met;
}

/// Behind an edge an object may stand, which the pixels between do not show.
std::optional<Rgb> RoomSeen::thing_radiance(const WorldRay& ray, double distance) const {
  const glm::dvec3 x = ray.origin + distance * glm::dvec3(ray.direction);
  if (!photograph)
    return std::nullopt;
  const auto seen = photograph->radiance(x);
  return seen ? seen : photograph->nearest(x);
}

Rgb RoomSeen::radiance(const WorldRay& ray, const std::optional<Hit>& hit, bool with_disc) const {
  if (hit) {
    const glm::dvec3 x = ray.origin + hit->distance * glm::dvec3(ray.direction);
    if (hit->triangle == kUnknownTriangle)
      return thing_radiance(ray, hit->distance).value_or(Rgb(0.0f));
    if (photograph && !(things && things->hide(x))) {
      const glm::dvec3 n = glm::dvec3(light.normal(hit->triangle, glm::dvec3(ray.direction)));
      const glm::dvec3 to_eye = photograph->eye() - x;
      if (glm::dot(n, to_eye) > kFlattest * glm::length(to_eye) &&
          !rays.occluded(rays.to_local(x + kAirGap_m * n), glm::vec3(to_eye), 0.0f, 1.0f))
        if (const auto seen = photograph->radiance(x))
          return *seen;
    }
    return computed(ray, *hit);
  }
  const glm::dvec3 direction(ray.direction);
  Rgb out = sky.interpolate(direction);
  if (with_disc && sun && glm::dot(direction, sun->direction) > std::cos(kSunAngularRadius))
    out +=
        sun->normal_irradiance * static_cast<float>(1.0 / (std::numbers::pi * kSunAngularRadius * kSunAngularRadius));
  return out * windows.met(ray.origin, direction, std::numeric_limits<double>::infinity()).transmittance;
}

/// L = rho / pi E.
Rgb RoomSeen::computed(const WorldRay& ray, const Hit& hit) const {
  const glm::dvec3 direction(ray.direction), x = ray.origin + hit.distance * direction;
  const Rgb& reflectance = room.material(room.triangles[hit.triangle]).reflectance;
  Rgb irradiance;
  if (shadow) {
    irradiance = shadow->irradiance_without_sun(hit.triangle, x, direction);
    if (sun) {
      const glm::dvec3 n = light.normal(hit.triangle, direction);
      const double cosine = glm::dot(n, sun->direction);
      if (cosine > 0.0)
        irradiance += static_cast<float>(cosine) * sun_at(x + kAirGap_m * n);
    }
  } else {
    const RoomPoint point = light.at_surface(hit.triangle, x, direction);
    irradiance = point.indirect_irradiance + point.open_sky_irradiance;
  }
  return reflectance * irradiance * std::numbers::inv_pi_v<float>;
}

/// E T V, towards the middle of the disc.
Rgb RoomSeen::sun_at(const glm::dvec3& x) const {
  if (!sun || rays.occluded(rays.to_local(x), glm::vec3(sun->direction), 0.0f, kInfinity))
    return Rgb(0.0f);
  const ApertureCrossings::Met pane = windows.met(x, sun->direction, std::numeric_limits<double>::infinity());
  if (pane.count == 0 || pane.transmittance == Rgb(0.0f))
    return Rgb(0.0f);
  return sun->normal_irradiance * pane.transmittance *
         objects.transmittance({x, glm::vec3(sun->direction)}, std::numeric_limits<double>::infinity());
}

} // namespace daylit
