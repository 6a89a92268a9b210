#pragma once

// Rays that points in the air aim at small holes. Few of a fan's rays find a small hole, and in a dark room behind one
// most light comes through it: what lies in its solid angle is sampled by rays of its own (stratified sampling: Shirley
// & Wang 1996), the fan's rays count elsewhere.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "radiosity/detail/ray_fan.h"

namespace daylit::radiosity {

/// Corners of a convex hole, in order, metres, relative to the mesh origin.
using HoleOutline = std::vector<glm::dvec3>;

/// A hole as a point sees it.
struct HoleView {
  std::vector<glm::dvec3> corner; ///< unit directions
  std::vector<glm::dvec3> inward; ///< normals of the planes through the point and two corners
  double solid_angle_sr = 0;

  static HoleView of(const HoleOutline& outline, const glm::dvec3& point);
  bool holds(const glm::dvec3& direction) const;
  /// Uniform in its solid angle, `u` in [0, 1)^2.
  glm::dvec3 direction(const glm::dvec2& u) const;
};

struct AimedRay {
  glm::vec3 direction; ///< unit
  float solid_angle_sr;
  std::int32_t patch; ///< that it meets; -1 for none or a black side
};

/// The aimed rays of one point, and the holes that they stand for.
struct AimedRays {
  std::vector<HoleView> hole;
  std::vector<AimedRay> ray;

  /// At the holes in which fewer of a fan's rays are expected than kRaysOfHole, those that look largest, of which
  /// `sees` (way from the point to the middle) says that nothing stands before them. Where two overlap, the larger
  /// counts, and one that lies within another, the far rim of a hole in a thick wall, is none. Rays without patches.
  static AimedRays of(const glm::dvec3& point, std::span<const HoleOutline> holes, int rays_of_fan,
                      const std::function<bool(const glm::vec3& way)>& sees);
  void add(HoleView view);
  bool covers(const glm::dvec3& direction) const;
  /// sum of B dw over the rays, sr; `radiosity` B of each patch.
  double light(std::span<const float> radiosity) const;
  /// Y_lm(w) dw / pi of each ray to rows[lm][aggregate], of nine.
  void add_harmonics(std::span<const std::uint32_t> aggregate_of, std::size_t aggregates, Bands bands,
                     float* rows) const;

  static constexpr int kRaysOfHole = 64;
  static constexpr std::size_t kMostHoles = 4;
  static constexpr std::size_t kMostBytes = 8192; ///< of a point
};

} // namespace daylit::radiosity
