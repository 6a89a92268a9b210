#include "runtime/reflect/room_seen.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "runtime/depth/depth_walk.h"
#include "scene/core/orthonormal.h"
#include "scene/material/fresnel.h"

namespace daylit {

namespace {
// Seen at a flatter angle, a pixel of the photograph stands for too long a piece of the surface.
constexpr double kFlattest = 0.05; // cosine
constexpr double kSampled = 0.8;   // of the disc's radius
constexpr float kMostChange =
    4.0f; // of the light of a point by the objects, where the photograph shows it without them
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr double kFar_m = std::numeric_limits<double>::infinity();
} // namespace

Rgb left_of(const Rgb& picture, const Rgb& photo) {
  Rgb left(1.0f);
  for (int c = 0; c < 3; ++c)
    if (photo[c] > 0.0f)
      left[c] = std::clamp(picture[c] / photo[c], 0.0f, 1.0f);
  return left;
}

PhotographedRoom::PhotographedRoom(const Composite& composite, const RenderCamera& camera, const LensModel& lens,
                                   const PhotoScale& scale, float white, const PhotoPixels* photo)
    : composite_(composite), camera_(camera), lens_(lens),
      camera_from_world_(glm::transpose(glm::dmat3(camera.world_from_camera))),
      radiance_from_photo_(glm::inverse(scale.scale * scale.colour_matrix)),
      scale_x_(lens.width_px > 0 ? static_cast<double>(camera.photo_width_px) / lens.width_px : 1.0),
      scale_y_(lens.height_px > 0 ? static_cast<double>(camera.photo_height_px) / lens.height_px : 1.0), white_(white),
      photo_(photo) {}

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

template <class Value>
std::optional<Rgb> PhotographedRoom::between_pixels(const glm::dvec2& p, const Value& value) const {
  const int x0 = std::min(static_cast<int>(p.x), camera_.photo_width_px - 2),
            y0 = std::min(static_cast<int>(p.y), camera_.photo_height_px - 2);
  const auto s = static_cast<float>(p.x - x0), t = static_cast<float>(p.y - y0);
  const std::size_t first = static_cast<std::size_t>(y0) * camera_.photo_width_px + x0;
  const std::size_t four[4] = {first, first + 1, first + camera_.photo_width_px, first + camera_.photo_width_px + 1};
  const float weight[4] = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
  Rgb sum(0.0f);
  for (int k = 0; k < 4; ++k) {
    const std::optional<Rgb> pixel = value(four[k]);
    if (!pixel)
      return std::nullopt;
    sum += weight[k] * *pixel;
  }
  return from_photo(sum);
}

std::optional<Rgb> PhotographedRoom::drawn_at(const glm::dvec2& place) const {
  return between_pixels(
      place, [&](std::size_t i) { return is_known(i) ? std::optional(composite_.picture.texels[i]) : std::nullopt; });
}

std::optional<Rgb> PhotographedRoom::radiance(const glm::dvec3& x) const {
  const auto place = pixel_of(x);
  return place ? drawn_at(*place) : std::nullopt;
}

std::optional<PhotographedRoom::Seen> PhotographedRoom::look(const glm::dvec3& x) const {
  const auto place = pixel_of(x);
  if (!place)
    return std::nullopt;
  if (const auto drawn = drawn_at(*place))
    return Seen{*drawn, false};
  if (!photo_)
    return std::nullopt;
  const auto without = between_pixels(*place, [&](std::size_t i) {
    const Rgb pixel = (*photo_)[i];
    return std::max({pixel.r, pixel.g, pixel.b}) < white_ ? std::optional(pixel) : std::nullopt;
  });
  return without ? std::optional(Seen{*without, true}) : std::nullopt;
}

Rgb PhotographedRoom::left_at(const glm::dvec3& x) const {
  const auto place = photo_ ? pixel_of(x) : std::nullopt;
  const auto drawn = place ? drawn_at(*place) : std::nullopt;
  if (!drawn)
    return Rgb(1.0f);
  return left_of(*drawn, *between_pixels(*place, [&](std::size_t i) { return std::optional<Rgb>((*photo_)[i]); }));
}

std::optional<Rgb> PhotographedRoom::nearest(const glm::dvec3& x) const {
  const auto p = pixel_of(x);
  if (!p)
    return std::nullopt;
  const std::size_t i = static_cast<std::size_t>(p->y + 0.5) * static_cast<std::size_t>(camera_.photo_width_px) +
                        static_cast<std::size_t>(p->x + 0.5);
  return is_known(i) ? std::optional(from_photo(composite_.picture.texels[i])) : std::nullopt;
}

void RoomSeen::find_ends(std::span<RoomRay> batch) const {
  RayPacket16 packet{};
  for (std::size_t k = 0; k < batch.size(); ++k)
    packet.set(k, rays.to_local(batch[k].ray.origin), batch[k].ray.direction, 0.0f,
               static_cast<float>(batch[k].most_m));
  RayHits16 hits;
  const std::uint32_t met = rays.closest16(packet, static_cast<int>(batch.size()), hits);
  for (std::size_t k = 0; k < batch.size(); ++k)
    batch[k].end =
        met >> k & 1u ? std::optional(RoomEnd{hits.triangle[k], static_cast<double>(hits.distance[k])}) : std::nullopt;
  if (things)
    for (RoomRay& r : batch)
      find_things(r);
}

/// A thing that the ray meets before the room; only one whose radiance the photograph says.
void RoomSeen::find_things(RoomRay& r) const {
  const auto distance = first_thing(*things, r.ray, r.end ? r.end->distance : r.most_m);
  if (distance && thing_radiance(r, *distance))
    r.end = RoomEnd{kUnknownTriangle, *distance};
}

/// Behind an edge an object may stand, which the pixels between do not show.
std::optional<Rgb> RoomSeen::thing_radiance(const RoomRay& r, double distance) const {
  const glm::dvec3 x = r.ray.origin + distance * glm::dvec3(r.ray.direction);
  if (!photograph)
    return std::nullopt;
  const auto seen = photograph->radiance(x);
  return seen ? seen : photograph->nearest(x);
}

/// The photograph where the way from there to the camera is free, else what is computed. Behind an object it is as it
/// was without the objects, and what they change is computed.
void RoomSeen::find_radiance(std::span<RoomRay> batch) const {
  std::uint32_t computed_rays = 0, photographed = 0, covered = 0;
  std::array<glm::dvec3, kRayBatch> x;
  for (std::size_t k = 0; k < batch.size(); ++k) {
    RoomRay& r = batch[k];
    x[k] = r.ray.origin + (r.end ? r.end->distance : 0.0) * glm::dvec3(r.ray.direction);
    if (!r.end)
      r.radiance = outside(r);
    else if (r.end->triangle == kUnknownTriangle)
      r.radiance = thing_radiance(r, r.end->distance).value_or(Rgb(0.0f));
    else if (const auto seen = photographed_at(r, x[k])) {
      r.radiance = seen->radiance;
      photographed |= 1u << k;
      covered |= seen->is_covered ? 1u << k : 0u;
    } else
      computed_rays |= 1u << k;
  }
  const std::uint32_t hidden = hidden_from_camera(batch, x, photographed);
  computed_rays |= hidden;
  if (!gloss.empty())
    take_out_gloss(batch, x, photographed & ~hidden, covered);
  for (std::uint32_t left = covered & ~hidden; left; left &= left - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(left));
    batch[k].radiance *= change(batch[k], x[k]);
  }
  for (std::uint32_t left = computed_rays; left; left &= left - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(left));
    batch[k].radiance = computed(batch[k], x[k]);
  }
}

/// By Fresnel's factor of a dielectric.
std::optional<MirroredRay> RoomSeen::mirrored(const WorldRay& ray, const RoomEnd& end) const {
  if (gloss.empty() || end.triangle == kUnknownTriangle || gloss[end.triangle] <= 0.0f)
    return std::nullopt;
  const glm::dvec3 direction(ray.direction), n = light.normal(end.triangle, direction);
  const double cosine = -glm::dot(n, direction);
  return MirroredRay{{ray.origin + end.distance * direction + kAirGap_m * n, glm::vec3(direction + 2.0 * cosine * n)},
                     fresnel_dielectric(static_cast<float>(cosine), ior_of(gloss[end.triangle]))};
}

/// V D = V photo - V F L, L what the camera sees mirrored there.
void RoomSeen::take_out_gloss(std::span<RoomRay> batch, std::span<const glm::dvec3> x, std::uint32_t photographed,
                              std::uint32_t covered) const {
  std::array<RoomRay, kRayBatch> mirrored_rays;
  std::array<std::pair<std::size_t, float>, kRayBatch> of;
  std::size_t count = 0;
  for (std::uint32_t left = photographed; left; left &= left - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(left));
    if (!batch[k].without_gloss)
      continue;
    const glm::dvec3 eye = photograph->eye();
    const double distance = glm::distance(x[k], eye);
    if (const auto on = mirrored({eye, glm::vec3((x[k] - eye) / distance)}, {batch[k].end->triangle, distance})) {
      mirrored_rays[count].ray = on->ray;
      of[count++] = {k, on->share};
    }
  }
  if (count == 0)
    return;
  find_ends({mirrored_rays.data(), count});
  find_radiance({mirrored_rays.data(), count});
  for (std::size_t m = 0; m < count; ++m) {
    const auto [k, share] = of[m];
    const Rgb left = covered >> k & 1u ? Rgb(1.0f) : photograph->left_at(x[k]);
    batch[k].radiance = glm::max(batch[k].radiance - share * left * mirrored_rays[m].radiance, Rgb(0.0f));
  }
}

/// What the photograph shows in the direction of x, whatever of the room stands before it.
std::optional<PhotographedRoom::Seen> RoomSeen::photographed_at(const RoomRay& r, const glm::dvec3& x) const {
  if (!photograph || (things && things->hide(x)))
    return std::nullopt;
  const glm::dvec3 to_eye = photograph->eye() - x;
  if (glm::dot(light.normal(r.end->triangle, glm::dvec3(r.ray.direction)), to_eye) <= kFlattest * glm::length(to_eye))
    return std::nullopt;
  return photograph->look(x);
}

/// Those of `asked` whose end the room hides from the camera.
std::uint32_t RoomSeen::hidden_from_camera(std::span<const RoomRay> batch, std::span<const glm::dvec3> x,
                                           std::uint32_t asked) const {
  RayPacket16 to_camera{};
  std::array<std::size_t, kRayBatch> ray_of{};
  std::size_t count = 0;
  for (std::uint32_t left = asked; left; left &= left - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(left));
    const glm::dvec3& n = light.normal(batch[k].end->triangle, glm::dvec3(batch[k].ray.direction));
    to_camera.set(count, rays.to_local(x[k] + kAirGap_m * n), glm::vec3(photograph->eye() - x[k]), 0.0f, 1.0f);
    ray_of[count++] = k;
  }
  std::uint32_t hidden = 0;
  for (std::uint32_t met = count ? rays.occluded16(to_camera, static_cast<int>(count)) : 0; met; met &= met - 1)
    hidden |= 1u << ray_of[static_cast<std::size_t>(std::countr_zero(met))];
  return hidden;
}

/// The texels are not wider than what is asked for.
Rgb RoomSeen::sky(const glm::vec3& direction, float width_rad) const {
  const float texels = width_rad * static_cast<float>(pyramid[0].height) * std::numbers::inv_pi_v<float>;
  const auto level = static_cast<std::size_t>(texels > 1.0f ? std::log2(texels) : 0.0f);
  return pyramid[std::min(level, pyramid.size() - 1)].interpolate(glm::dvec3(direction));
}

/// Sky and disc through the panes on the way.
Rgb RoomSeen::outside(const RoomRay& r) const {
  const glm::dvec3 direction(r.ray.direction);
  Rgb out = sky(r.ray.direction, r.width_rad);
  if (r.width_rad == 0.0f && sun && glm::dot(direction, sun->direction) > std::cos(kSunAngularRadius))
    out +=
        sun->normal_irradiance * static_cast<float>(1.0 / (std::numbers::pi * kSunAngularRadius * kSunAngularRadius));
  return out * windows.met(r.ray.origin, direction, std::numeric_limits<double>::infinity()).transmittance;
}

RoomIrradiance RoomSeen::irradiance(const RoomRay& r, const glm::dvec3& x) const {
  const std::uint32_t triangle = r.end->triangle;
  const glm::dvec3 direction(r.ray.direction);
  if (!shadow) {
    const RoomPoint point = light.at_surface(triangle, x, direction);
    const Rgb all = point.indirect_irradiance + point.open_sky_irradiance;
    return {all, all};
  }
  if (r.past_objects)
    return shadow->irradiance_without_sun(triangle, x, direction, false);
  RoomIrradiance e = shadow->irradiance_without_sun(triangle, x, direction);
  const glm::dvec3 n = light.normal(triangle, direction);
  if (const double cosine = sun ? glm::dot(n, sun->direction) : 0.0; cosine > 0.0) {
    const glm::dvec3 air = x + kAirGap_m * n;
    const Rgb arrives = static_cast<float>(cosine) * sun->normal_irradiance * passes_room(air, sun->direction);
    e.before += arrives;
    if (arrives != Rgb(0.0f))
      e.now += arrives * objects.transmittance({air, glm::vec3(sun->direction)}, kFar_m);
  }
  return e;
}

/// L = rho / pi E.
Rgb RoomSeen::computed(const RoomRay& r, const glm::dvec3& x) const {
  const Rgb& reflectance = room.material(room.triangles[r.end->triangle]).reflectance;
  return reflectance * irradiance(r, x).now * std::numbers::inv_pi_v<float>;
}

/// E with the objects / E without.
Rgb RoomSeen::change(const RoomRay& r, const glm::dvec3& x) const {
  const bool may_shade =
      sun && glm::dot(light.normal(r.end->triangle, glm::dvec3(r.ray.direction)), sun->direction) > 0.0;
  if (!shadow || (!may_shade && !shadow->affects(x)))
    return Rgb(1.0f);
  const RoomIrradiance e = irradiance(r, x);
  Rgb factor(1.0f);
  for (int c = 0; c < 3; ++c)
    if (e.before[c] > 0.0f)
      factor[c] = std::min(e.now[c] / e.before[c], kMostChange);
  return factor;
}

Rgb RoomSeen::arrives_from(const glm::dvec3& x, const glm::dvec3& direction) const {
  const Rgb past_room = passes_room(x, direction);
  return past_room == Rgb(0.0f) ? past_room : past_room * objects.transmittance({x, glm::vec3(direction)}, kFar_m);
}

Rgb RoomSeen::arrives_freely_from(const glm::dvec3& x, const glm::dvec3& direction) const {
  const Rgb past_room = passes_room(x, direction);
  return past_room == Rgb(0.0f) || objects.closest({x, glm::vec3(direction)}, kFar_m) ? Rgb(0.0f) : past_room;
}

/// T V without the objects; the panes first, which cost less than a ray.
Rgb RoomSeen::passes_room(const glm::dvec3& x, const glm::dvec3& direction) const {
  const ApertureCrossings::Met pane = windows.met(x, direction, std::numeric_limits<double>::infinity());
  if (pane.count == 0 || pane.transmittance == Rgb(0.0f) ||
      rays.occluded(rays.to_local(x), glm::vec3(direction), 0.0f, kInfinity))
    return Rgb(0.0f);
  return pane.transmittance;
}

/// Towards the middle of the disc.
Rgb RoomSeen::sun_at(const glm::dvec3& x) const {
  return sun ? sun->normal_irradiance * arrives_from(x, sun->direction) : Rgb(0.0f);
}

/// Near the edge, so that little more than the half shadow's border is lost: a highlight may be far brighter than
/// white.
Rgb RoomSeen::disc_at(const glm::dvec3& x, double turn) const {
  if (!sun)
    return Rgb(0.0f);
  const OrthonormalBasis across(sun->direction);
  Rgb part(0.0f);
  for (int k = 0; k < 4; ++k) {
    const double angle = 0.5 * std::numbers::pi * (k + turn);
    const glm::dvec3 aside = std::cos(angle) * across.u + std::sin(angle) * across.v;
    part += 0.25f * arrives_from(x, glm::normalize(sun->direction + kSampled * kSunAngularRadius * aside));
  }
  return sun->normal_irradiance * part;
}

} // namespace daylit
