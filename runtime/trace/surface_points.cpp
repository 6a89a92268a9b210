#include "runtime/trace/surface_points.h"

#include <algorithm>

#include <glm/geometric.hpp>

namespace daylit {

namespace {

constexpr float kGrazing = 0.1f; // cosine
constexpr float kTurned = 0.6f;  // of the facet's cosine

/// The winding decides what is a back, not the normal: interpolated normals turn away at silhouettes. There a ray can
/// also slip between a facet and its neighbour that just faces away: a grazing back is the front where the normal of a
/// corner, a mean over its facets, faces away clearly less than the facet. A flat sheet seen from behind keeps its
/// back.
bool is_back(const glm::vec3& facet, const glm::vec3 (&normals)[3], const glm::vec3& to_eye) {
  const float away = -glm::dot(facet, to_eye) / std::max(glm::length(facet), 1e-30f); // cosine times the distance
  if (away <= 0.0f)
    return false;
  const auto turned = [&](const glm::vec3& n) { return -glm::dot(n, to_eye) < kTurned * away; };
  return away > kGrazing * glm::length(to_eye) || !std::any_of(normals, normals + 3, turned);
}

} // namespace

float start_offset(const TracedScene& scene) {
  return std::max(2e-5f, 3e-4f * static_cast<float>(scene.sphere.radius));
}

/// A facet of a smooth surface shadows its own neighbours near the terminator. Rays start on the surface that the
/// normals describe: the mean of the point's projections onto the vertices' tangent planes, where these lie outside
/// (Hanika 2021, "Hacking the Shadow Terminator").
PixelSurface object_surface(const TracedScene& scene, const glm::vec3& eye, const ObjectHit& hit) {
  const auto& t = scene.triangles[hit.triangle];
  const float b[3] = {1.0f - hit.u - hit.v, hit.u, hit.v};
  const glm::vec3 p[3] = {scene.positions[t[0]], scene.positions[t[1]], scene.positions[t[2]]};
  const glm::vec3 n[3] = {scene.normals[t[0]], scene.normals[t[1]], scene.normals[t[2]]};
  PixelSurface s;
  s.exists = s.receives = true;
  for (int k = 0; k < 3; ++k) {
    s.position += b[k] * p[k];
    s.normal += b[k] * n[k];
  }
  const glm::vec3 facet = glm::cross(p[1] - p[0], p[2] - p[0]);
  const float length = glm::length(s.normal);
  s.normal = length > 0.0f ? s.normal / length : facet / std::max(glm::length(facet), 1e-30f);
  s.back = is_back(facet, n, eye - s.position);
  const float side = s.back ? -1.0f : 1.0f, size = glm::length(facet);
  if (std::any_of(n, n + 3, [&](const glm::vec3& corner) { return glm::dot(corner, facet) < kSharpEdge * size; }))
    s.sharp_facet = facet * (side / std::max(size, 1e-30f));
  s.normal *= side;
  s.start = s.position + start_offset(scene) * s.normal;
  for (int k = 0; k < 3; ++k) {
    const float below = std::min(0.0f, side * glm::dot(s.position - p[k], n[k]));
    s.start -= b[k] * below * side * n[k];
  }
  return s;
}

PixelSurface room_surface(const TracedScene& scene, const glm::vec3& eye, std::uint32_t triangle,
                          const glm::vec3& position, bool receives) {
  const glm::vec3& n = scene.room_normals[triangle];
  return {true, receives, position, glm::dot(n, eye - position) < 0.0f ? -n : n, position, false};
}

/// The ray eye + t w of the next pixel meets the plane n.x = n.p at t = n.(p - eye) / n.w.
PixelFootprint room_footprint(const VisibleSurfaces& view, const glm::vec3& x, const glm::vec3& normal,
                              const glm::ivec2& pixel) {
  const auto direction = [&](int right, int down) {
    return view.direction(static_cast<float>(pixel.x + right), static_cast<float>(pixel.y + down));
  };
  const glm::vec3 eye = view.eye(), own = direction(0, 0);
  const float height = glm::dot(normal, x - eye), distance = glm::length(x - eye) / glm::length(own);
  const auto step = [&](const glm::vec3& next) {
    const float along = glm::dot(normal, next);
    const glm::vec3 on_plane =
        along * height > 0.0f ? next * (height / along) - own * (height / glm::dot(normal, own)) : glm::vec3(0.0f);
    const float most = kMostStretched * distance * glm::length(next - own), length = glm::length(on_plane);
    return length > most ? on_plane * (most / length) : on_plane;
  };
  return {step(direction(1, 0)), step(direction(0, 1)), glm::vec3(0.0f)};
}

namespace {
constexpr float kOneSurface = 0.8f; // cosine between the normals of neighbouring pixels

struct Steps {
  glm::vec3 next{0.0f}; ///< from the point of a pixel to that of the next, or the way back from the one before
  float rise = 0.0f;    ///< the larger height of the two over the tangent plane, or below it
};

/// Nothing where neither shows the same smooth surface.
Steps steps_along(const TracedScene& scene, const VisibleSurfaces& view, const glm::vec3& x, const glm::vec3& normal,
                  const glm::ivec2& pixel, const glm::ivec2& next) {
  Steps steps;
  for (const int sign : {-1, 1}) {
    const glm::ivec2 other = pixel + sign * next;
    const ObjectHit& hit = view.object(other.x, other.y);
    if (hit.samples == 0 || view.is_edge(other.x, other.y))
      continue;
    const PixelSurface there = object_surface(scene, view.eye(), hit);
    if (glm::dot(there.normal, normal) <= kOneSurface)
      continue;
    const glm::vec3 d = there.position - x;
    steps.rise = std::max(steps.rise, std::abs(glm::dot(normal, d)));
    steps.next = static_cast<float>(sign) * d;
  }
  return steps;
}
} // namespace

/// d - (n.d) n of both ways d along the tangent plane, and |n.d| by which the surface leaves it.
PixelFootprint object_footprint(const TracedScene& scene, const VisibleSurfaces& view, const glm::vec3& x,
                                const glm::vec3& normal, const glm::ivec2& pixel) {
  const Steps right = steps_along(scene, view, x, normal, pixel, {1, 0}),
              down = steps_along(scene, view, x, normal, pixel, {0, 1});
  return {right.next - glm::dot(normal, right.next) * normal, down.next - glm::dot(normal, down.next) * normal,
          std::max(right.rise, down.rise) * normal};
}

} // namespace daylit
