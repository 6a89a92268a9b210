#include "bench/hole_truth.h"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>

#include "bench/chance.h"
#include "scene/core/parallel_stage.h"
#include "scene/room/ray_scene.h"
#include "simulate/path_tracer.h"

namespace daylit::bench {

namespace {

constexpr int kCertain = 4; ///< surfaces that every path meets
constexpr float kPi = std::numbers::pi_v<float>;

class HolePaths {
public:
  HolePaths(const Room& room, const RayScene& rays, const TraceScene& scene, const HoleMouth& mouth)
      : room_(room), rays_(rays), tracer_(scene), mouth_(mouth), off_(4.0f * rays.surface_offset()) {}

  /// One path: E = its light from the mouth without what comes straight from the sky, and pi times the radiance of the
  /// surfaces behind it.
  Rgb irradiance(const Receiver& receiver, Chance& chance) const {
    glm::dvec3 x = receiver.position, n = receiver.normal;
    Rgb sum = from_mouth(x, n, false, chance), weight(kPi);
    for (int met = 1;; ++met) {
      const glm::vec3 d = sample_cosine(glm::vec3(n), {chance.between(0, 1), chance.between(0, 1)});
      RayHit hit;
      if (!rays_.closest(rays_.to_local(x), d, off_, std::numeric_limits<float>::infinity(), hit))
        return sum;
      const glm::dvec3 to = x + static_cast<double>(hit.distance) * glm::dvec3(d);
      if (leaves(x, to))
        return sum;
      const RoomTriangle& triangle = room_.triangles[hit.triangle];
      n = glm::normalize(area_normal(room_, triangle));
      n = glm::dot(n, glm::dvec3(d)) > 0.0 ? -n : n;
      x = to + static_cast<double>(off_) * n;
      weight *= room_.material(triangle).reflectance;
      sum += weight / kPi * from_mouth(x, n, true, chance);
      const float left = std::max({weight.r, weight.g, weight.b}) / kPi;
      if (met >= kCertain && chance.between(0, 1) >= static_cast<double>(left)) // Russian roulette
        return sum;
      weight /= met >= kCertain ? left : 1.0f;
    }
  }

private:
  /// The way from a to b passes the mouth.
  bool leaves(const glm::dvec3& a, const glm::dvec3& b) const {
    const double before = glm::dot(a - mouth_.corner, mouth_.inward),
                 after = glm::dot(b - mouth_.corner, mouth_.inward);
    if (before * after >= 0.0)
      return false;
    const glm::dvec3 q = a + before / (before - after) * (b - a) - mouth_.corner;
    const double u = glm::dot(q, mouth_.u) / glm::dot(mouth_.u, mouth_.u),
                 v = glm::dot(q, mouth_.v) / glm::dot(mouth_.v, mouth_.v);
    return u > 0.0 && u < 1.0 && v > 0.0 && v < 1.0;
  }

  /// L cos cos' A / r^2 of a point of the mouth; L by a path through it, `sky`: with what comes straight from there.
  Rgb from_mouth(const glm::dvec3& x, const glm::dvec3& n, bool sky, Chance& chance) const {
    const double u = chance.between(0, 1), v = chance.between(0, 1);
    const auto key = static_cast<std::uint32_t>(chance.below(std::numeric_limits<std::uint32_t>::max()));
    const glm::dvec3 y = mouth_.corner + u * mouth_.u + v * mouth_.v, way = y - x;
    const double distance = glm::length(way);
    const glm::dvec3 d = way / distance;
    const double cosines = glm::dot(n, d) * -glm::dot(mouth_.inward, d);
    if (glm::dot(n, d) <= 0.0 || cosines <= 0.0 ||
        rays_.occluded(rays_.to_local(x), glm::vec3(d), off_, static_cast<float>(distance)))
      return Rgb(0.0f);
    const SampleStream samples(key, 0);
    const glm::vec3 origin = rays_.to_local(y), direction(d);
    const Rgb radiance = sky ? tracer_.radiance(origin, direction, samples, false).value
                             : tracer_.indirect_radiance(origin, direction, samples, false).value;
    return static_cast<float>(cosines * glm::length(glm::cross(mouth_.u, mouth_.v)) / (distance * distance)) * radiance;
  }

  const Room& room_;
  const RayScene& rays_;
  PathTracer tracer_;
  HoleMouth mouth_;
  float off_;
};

} // namespace

/// Mean of the paths, and the standard error of kBatches means.
Result<std::vector<IrradianceEstimate>> trace_through_hole(const Room& room, const TraceScene& scene,
                                                           const HoleMouth& mouth, std::span<const Receiver> receivers,
                                                           const IrradianceSettings& settings,
                                                           const Progress& progress) {
  const auto rays = RayScene::build(room);
  if (!rays)
    return rays.error();
  const HolePaths paths(room, *rays, scene, mouth);
  const int per_batch = (settings.samples + kBatches - 1) / kBatches;
  std::vector<IrradianceEstimate> list(receivers.size());
  const Result<void> traced = parallel_stage("paths", receivers.size(), 1, progress, [&](std::size_t r) {
    Chance chance(settings.seed + static_cast<std::uint32_t>(r));
    std::array<glm::dvec3, kBatches> batch{};
    glm::dvec3 mean(0.0), spread(0.0);
    for (glm::dvec3& b : batch) {
      for (int i = 0; i < per_batch; ++i)
        b += glm::dvec3(paths.irradiance(receivers[r], chance)) / static_cast<double>(per_batch);
      mean += b / static_cast<double>(kBatches);
    }
    for (const glm::dvec3& b : batch)
      spread += (b - mean) * (b - mean);
    list[r] = {Rgb(mean), Rgb(glm::sqrt(spread / static_cast<double>(kBatches * (kBatches - 1))))};
  });
  if (!traced)
    return traced.error();
  return list;
}

} // namespace daylit::bench
