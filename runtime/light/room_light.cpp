#include "runtime/light/room_light.h"

#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace daylit {

namespace {
// Probes answer for the air: a point on a wall is asked for this far in front of it, metres.
constexpr double kAir = 1e-3;
} // namespace

void RoomLight::set_frame(const LightField& field, std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells,
                          const LightSet& lights) {
  field_ = &field;
  pyramid_ = pyramid;
  cells_ = cells;
  sun_normal_irradiance_ = Rgb(0.0f);
  for (const DirectionalLight& l : lights.sun)
    sun_normal_irradiance_ += l.irradiance;
}

std::optional<RoomPoint> RoomLight::at(const glm::dvec3& eye, const glm::dvec3& direction) const {
  RayHit hit;
  if (!rays_.closest(rays_.to_local(eye), glm::vec3(direction), 0.0f, std::numeric_limits<float>::infinity(), hit))
    return std::nullopt;
  const RoomTriangle& triangle = room_.triangles[hit.triangle];
  glm::dvec3 n = glm::normalize(area_normal(room_, triangle));
  if (glm::dot(n, direction) > 0.0)
    n = -n;
  const glm::dvec3 x = eye + static_cast<double>(hit.distance) * direction;
  RoomPoint point;
  point.reflectance = room_.material(triangle).reflectance;
  point.open_sky_irradiance = open_sky_irradiance(pyramid_, cells_, x, n);
  // The shares of the sun carry its cosine and the mean transmittance of the pane.
  point.sun_normal_irradiance = sun_normal_irradiance_;
  if (const auto light = sampler_.sample(*field_, x + kAir * n))
    point.indirect_irradiance = glm::max(irradiance(*light, glm::vec3(n)), Rgb(0.0f));
  return point;
}

} // namespace daylit
