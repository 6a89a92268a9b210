#include "bench/direct_reference.h"

#include <cmath>
#include <limits>
#include <utility>

#include <glm/geometric.hpp>

#include "scene/room/aperture.h"
#include "scene/room/glass.h"

namespace daylit::bench {

struct DirectLightReference::State {
  RayScene room, object;
  std::vector<Aperture> apertures;
  const ObjectSurface& surface;
};

namespace {

/// A number in [0, 1) from a pixel and a sample.
double jitter(std::uint32_t a, std::uint32_t b) {
  std::uint32_t h = a * 0x9E3779B9u ^ (b + 0x7F4A7C15u) * 0x85EBCA6Bu;
  h ^= h >> 16;
  h *= 0x7FEB352Du;
  h ^= h >> 15;
  h *= 0x846CA68Bu;
  h ^= h >> 16;
  return h * 0x1p-32;
}

} // namespace

Result<DirectLightReference> DirectLightReference::make(const Room& room, std::span<const Aperture> apertures,
                                                        const ObjectSurface& object) {
  auto walls = RayScene::build(room);
  auto mesh = RayScene::build(object.positions, object.triangles);
  if (!walls || !mesh)
    return walls ? mesh.error() : walls.error();
  DirectLightReference reference;
  reference.state_ =
      std::make_shared<State>(State{std::move(*walls), std::move(*mesh), {apertures.begin(), apertures.end()}, object});
  return reference;
}

/// The front of the object, nothing before it. Normals are interpolated, facets decide what is a front.
bool DirectLightReference::seen(const glm::dvec3& eye, const glm::dvec3& w, SeenPoint& point) const {
  const State& s = *state_;
  const float far = std::numeric_limits<float>::infinity();
  RayHit hit, wall;
  if (!s.object.closest(s.object.to_local(eye), glm::vec3(w), 0.0f, far, hit) ||
      (s.room.closest(s.room.to_local(eye), glm::vec3(w), 0.0f, far, wall) && wall.distance < hit.distance))
    return false;
  const auto& t = s.surface.triangles[hit.triangle];
  const double b[3] = {1.0 - static_cast<double>(hit.u) - static_cast<double>(hit.v), static_cast<double>(hit.u),
                       static_cast<double>(hit.v)};
  point = {eye + static_cast<double>(hit.distance) * w, glm::dvec3(0.0), Rgb(0.0f)};
  for (int k = 0; k < 3; ++k) {
    point.normal += b[k] * glm::dvec3(s.surface.normals[t[k]]);
    point.reflectance += static_cast<float>(b[k]) * s.surface.reflectance[t[k]];
  }
  point.normal = glm::normalize(point.normal);
  const glm::dvec3 p = s.surface.positions[t[0]];
  return glm::dot(glm::cross(s.surface.positions[t[1]] - p, s.surface.positions[t[2]] - p), w) < 0.0;
}

std::vector<SeenPixel> DirectLightReference::seen_pixels(const RenderCamera& camera, int stride, int side) const {
  const glm::dvec3 eye = camera.eye();
  std::vector<SeenPixel> pixels;
  SeenPoint point;
  for (int y = 2; y + 2 < camera.height_px; y += stride)
    for (int x = 2; x + 2 < camera.width_px; x += stride) {
      bool inside = true;
      for (const auto& [u, v] : {std::pair{-2, 0}, {2, 0}, {0, -2}, {0, 2}})
        inside = inside && seen(eye, camera.direction({x + u, y + v}), point);
      SeenPixel pixel{x, y, {}};
      const std::uint32_t key = static_cast<std::uint32_t>(y * 65536 + x);
      for (int i = 0; inside && i < side * side; ++i) {
        const double s = side > 1 ? jitter(key, static_cast<std::uint32_t>(2 * i)) : 0.5,
                     t = side > 1 ? jitter(key, static_cast<std::uint32_t>(2 * i + 1)) : 0.5;
        inside = seen(eye, camera.direction({x - 0.5 + (i % side + s) / side, y - 0.5 + (i / side + t) / side}), point);
        pixel.points.push_back(point);
      }
      if (inside)
        pixels.push_back(std::move(pixel));
    }
  return pixels;
}

bool DirectLightReference::open(const SeenPoint& at, const glm::dvec3& w) const {
  const State& s = *state_;
  constexpr double kOff_m = 3e-4; // out of the facet that the interpolated normal does not belong to
  const glm::dvec3 start = at.position + kOff_m * at.normal;
  const float far = std::numeric_limits<float>::infinity();
  return !s.object.occluded(s.object.to_local(start), glm::vec3(w), 0.0f, far) &&
         !s.room.occluded(s.room.to_local(start), glm::vec3(w), 0.0f, far);
}

Rgb DirectLightReference::irradiance(const SeenPoint& at, const AnalyticSky& sky, int side, std::uint32_t seed) const {
  glm::dvec3 sum(0.0);
  for (const Aperture& a : state_->apertures) {
    const glm::dvec3 u = a.corners[1] - a.corners[0], v = a.corners.back() - a.corners[0]; // rectangular panes
    const double area = glm::length(glm::cross(u, v)) / (side * side);
    for (int i = 0; i < side * side; ++i) {
      const double s = (i % side + jitter(seed, static_cast<std::uint32_t>(2 * i))) / side,
                   t = (i / side + jitter(seed, static_cast<std::uint32_t>(2 * i + 1))) / side;
      const glm::dvec3 d = a.corners[0] + s * u + t * v - at.position;
      const double r2 = glm::dot(d, d);
      const glm::dvec3 w = d / std::sqrt(r2);
      const double leaving = -glm::dot(a.inward, w), receiving = glm::dot(at.normal, w);
      if (leaving > 0.0 && receiving > 0.0 && open(at, w))
        sum += leaving * receiving * area / r2 * glm::dvec3(sky.sky_radiance(w) * pane_transmittance(a, leaving));
    }
  }
  return Rgb(sum);
}

Rgb DirectLightReference::irradiance(const SeenPoint& at, std::span<const DirectionalLight> lights) const {
  glm::dvec3 sum(0.0);
  for (const DirectionalLight& l : lights) {
    const double cosine = glm::dot(at.normal, l.direction);
    int crossed = 0;
    if (cosine <= 0.0)
      continue;
    const Rgb pane = aperture_transmittance(state_->apertures, at.position, l.direction,
                                            std::numeric_limits<double>::infinity(), &crossed);
    if (crossed > 0 && open(at, l.direction))
      sum += cosine * glm::dvec3(l.irradiance * pane);
  }
  return Rgb(sum);
}

} // namespace daylit::bench
