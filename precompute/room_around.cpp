#include "precompute/room_around.h"

#include <algorithm>
#include <limits>
#include <vector>

#include <fmt/format.h>

#include "radiosity/detail/sampling.h"
#include "scene/core/parallel.h"
#include "scene/room/ray_scene.h"

namespace daylit::precompute {

namespace {

constexpr std::uint32_t kRays = 8192;
constexpr double kBehindGaps = 0.015;    // of the rays, on each side: what a door or a window lets through
constexpr float kOnFace = 1e-5f;         // of the room's diagonal
constexpr double kEnclosed = 0.5;        // of the rays that have to meet something
constexpr std::uint32_t kAirRays = 256;  // from each point: 20 points within 3 m find a niche of 30 cm
constexpr double kBeforeSurface = 0.999; // of the way to a hit

glm::dvec3 direction(std::uint32_t k) { return radiosity::sphere_direction(r2_point(k, glm::dvec2(0.0))); }

} // namespace

double volume(const Bounds& box) {
  const glm::dvec3 size = box.size();
  return size.x * size.y * size.z;
}

/// On each axis the surfaces met between the quantiles 0.015 and 0.985: walls that face the point take more than that.
Result<Bounds> room_around(const Room& room, const glm::dvec3& point) {
  std::vector<std::array<std::uint32_t, 3>> triangles; // panes too: outdoors is no part of a room
  for (const RoomTriangle& t : room.triangles)
    triangles.push_back(t.vertex);
  const Result<RayScene> scene = RayScene::build(room.vertices, triangles);
  if (!scene)
    return scene.error();
  if (const auto near = kOnFace * static_cast<float>(glm::length(room.bounds().size()));
      scene->distance(scene->to_local(point), near) < near)
    return Error{ErrorCode::value_invalid,
                 fmt::format("the point ({:g}, {:g}, {:g}) lies on a face", point.x, point.y, point.z), "--inside",
                 "give a point in the air of a room, in metres"};
  std::array<std::vector<double>, 3> met;
  for (std::uint32_t k = 0; k < kRays; ++k) {
    const glm::dvec3 d = direction(k);
    RayHit hit;
    if (!scene->closest(scene->to_local(point), glm::vec3(d), 0.0f, std::numeric_limits<float>::infinity(), hit))
      continue;
    for (int axis = 0; axis < 3; ++axis)
      met[static_cast<std::size_t>(axis)].push_back(point[axis] + static_cast<double>(hit.distance) * d[axis]);
  }
  if (static_cast<double>(met[0].size()) < kEnclosed * kRays)
    return Error{ErrorCode::value_invalid,
                 fmt::format("nothing encloses the point ({:g}, {:g}, {:g})", point.x, point.y, point.z), "--inside",
                 "give a point in the air of a room, in metres"};
  Bounds box;
  const auto tail = static_cast<std::ptrdiff_t>(kBehindGaps * static_cast<double>(met[0].size()));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::ranges::sort(met[axis]);
    box.min[static_cast<int>(axis)] = *(met[axis].begin() + tail);
    box.max[static_cast<int>(axis)] = *(met[axis].end() - 1 - tail);
  }
  return box;
}

Bounds air_around(const Room& room, const RayScene& scene, const std::vector<Aperture>& apertures,
                  const std::vector<glm::dvec3>& points) {
  const ApertureCrossings openings(apertures);
  std::vector<Bounds> seen(points.size());
  parallel_for(std::size_t{0}, points.size(), [&](std::size_t p) {
    for (std::uint32_t k = 0; k < kAirRays; ++k) {
      const glm::dvec3 d = direction(k);
      RayHit hit;
      const bool met =
          scene.closest(scene.to_local(points[p]), glm::vec3(d), 0.0f, std::numeric_limits<float>::infinity(), hit);
      const double far = met ? static_cast<double>(hit.distance) : glm::length(room.bounds().size());
      if (openings.met(points[p], d, kBeforeSurface * far).count > 0)
        continue;
      if (!met) {
        seen[p] = room.bounds();
        break;
      }
      seen[p].include(points[p] + far * d);
    }
  });
  Bounds box;
  for (const Bounds& one : seen)
    if (!one.empty()) {
      box.include(one.min);
      box.include(one.max);
    }
  return box;
}

} // namespace daylit::precompute
