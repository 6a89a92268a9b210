#include "runtime/indirect/lamp_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/indirect/feedback_term.h"
#include "runtime/sky/window_sampler.h"
#include "scene/core/orthonormal.h"
#include "scene/core/parallel.h"
#include "sh/sh9.h"

namespace daylit {

namespace {

constexpr std::size_t kShotPoints = 1024, kShotsEach = 16; // on both sides of the lamps' surfaces
constexpr int kPatchRays = 256;                            // from each patch
constexpr int kSeenRays = 512;                             // up and down from each part
constexpr std::size_t kMostPatches = 8192;                 // a building: those nearest to the lamps by reflections
constexpr int kBounces = 64;
constexpr float kSettled = 1e-3f; // of the brightest patch
constexpr double kLift = 0.002;   // of the radius: rays leave the surface above its own facets
constexpr int kPartDirections = 256;

/// Where the power of the lamps leaves.
struct ShotPoint {
  glm::dvec3 x{0.0}, n{0.0};
  Rgb power{0.0f}; ///< of each ray
};
struct Landed {
  RoomPatch* patch = nullptr;
  Rgb power{0.0f};
};

/// Triangle by triangle, in proportion to area times emission; R2 sequence within (Roberts 2018). A point stands for
/// pi L A / p of power on its side.
std::vector<ShotPoint> shot_points(const ObjectSurface& surface) {
  std::vector<double> sum{0.0};
  std::vector<Rgb> emission;
  for (const auto& t : surface.triangles) {
    const glm::dvec3 a = surface.positions[t[0]];
    const double area = 0.5 * glm::length(glm::cross(surface.positions[t[1]] - a, surface.positions[t[2]] - a));
    emission.push_back((surface.emission[t[0]] + surface.emission[t[1]] + surface.emission[t[2]]) / 3.0f);
    sum.push_back(sum.back() + area * static_cast<double>(luminance(emission.back())));
  }
  std::vector<ShotPoint> points;
  for (std::size_t k = 0; k < kShotPoints && sum.back() > 0.0; ++k) {
    const double place = (static_cast<double>(k / 2) + 0.5) / (kShotPoints / 2) * sum.back();
    const auto which = static_cast<std::size_t>(std::ranges::upper_bound(sum, place) - sum.begin()) - 1;
    const auto& t = surface.triangles[std::min(which, emission.size() - 1)];
    const Rgb& sent = emission[std::min(which, emission.size() - 1)];
    glm::dvec2 u = glm::fract(0.5 + static_cast<double>(k / 2) * glm::dvec2(0.7548776662, 0.5698402910));
    if (u.x + u.y > 1.0)
      u = 1.0 - u;
    const glm::dvec3 a = surface.positions[t[0]], ab = surface.positions[t[1]] - a, ac = surface.positions[t[2]] - a;
    const glm::dvec3 n = (k % 2 == 0 ? 1.0 : -1.0) * glm::normalize(glm::cross(ab, ac));
    const double power = std::numbers::pi * sum.back() / (kShotPoints / 2 * kShotsEach);
    points.push_back(
        {a + u.x * ab + u.y * ac, n, static_cast<float>(power / static_cast<double>(luminance(sent))) * sent});
  }
  return points;
}

} // namespace

std::size_t LampLight::number_of(RoomPatch* patch) {
  const auto [entry, made] = number_.emplace(patch, known_.size());
  if (made)
    known_.push_back({patch, static_cast<float>(patches_.area_m2(*patch)), Rgb(0.0f), {}});
  return entry->second;
}

/// Each ray by the cosine with the surface; E = power that lands on a patch / area.
void LampLight::shoot(const ObjectSurface& surface) {
  static const DirectionPattern pattern(kShotPoints * kShotsEach);
  const std::vector<ShotPoint> points = shot_points(surface);
  std::vector<std::vector<Landed>> landed(points.size());
  double lift = kAirGap_m;
  for (std::size_t k = 0; k < parts_.size(); ++k)
    lift = std::max(lift, kLift * parts_.sphere(k).radius);
  parallel_for(std::size_t{0}, points.size(), [&](std::size_t k) {
    const OrthonormalBasis basis(points[k].n);
    const glm::dvec3 x = points[k].x + lift * points[k].n;
    std::array<glm::dvec3, kShotsEach> w;
    for (std::size_t j = 0; j < kShotsEach; ++j)
      w[j] = in_hemisphere(basis, points[k].n, pattern.points()[j * kShotPoints + k * 389 % kShotPoints]);
    RayHits16 hits;
    const std::uint32_t ends = rays_.closest16(
        ray_fan(rays_.to_local(x), kShotsEach, [&](std::size_t j) { return glm::vec3(w[j]); }), kShotsEach, hits);
    for (std::size_t j = 0; j < kShotsEach; ++j) {
      const glm::dvec3 end = x + static_cast<double>(hits.distance[j]) * w[j];
      if (ends >> j & 1u && !parts_.between(x, end))
        landed[k].push_back({patches_.at(hits.triangle[j], end, w[j]), points[k].power});
    }
  });
  for (const std::vector<Landed>& of_point : landed)
    for (const Landed& l : of_point)
      if (Known& known = known_[number_of(l.patch)]; known.area_m2 > 0.0f)
        known.lamp += l.power / known.area_m2;
}

/// By rays to all sides from the middles of the parts.
std::vector<RoomPatch*> LampLight::find_seen_by_parts() {
  static const DirectionPattern pattern(kSeenRays);
  changes_ = true;
  std::vector<RoomPatch*> seen;
  for (std::size_t k = 0; k < parts_.size(); ++k)
    for (const double side : {1.0, -1.0})
      look_around(rays_, parts_.sphere(k).centre, glm::dvec3(0.0, 0.0, side), pattern,
                  [&](std::uint32_t triangle, const glm::dvec3& position, const glm::dvec3& w) {
                    RoomPatch* patch = patches_.at(triangle, position, w);
                    if (!patch->lit || std::ranges::find(seen, patch) != seen.end())
                      return;
                    number_of(patch);
                    seen.push_back(patch);
                  });
  find_all();
  return seen;
}

void LampLight::set_changes(std::span<RoomPatch* const> patches, std::span<const Rgb> changes) {
  for (const Known& k : known_) { // from nothing, so that what was before does not show
    k.patch->lamp_first = k.lamp;
    k.patch->lamp_later = Rgb(0.0f);
  }
  for (std::size_t k = 0; k < patches.size(); ++k)
    patches[k]->lamp_first += changes[k];
  solve();
}

/// What the patches see, what these see, and so on.
void LampLight::find_all() {
  static const DirectionPattern pattern(kPatchRays);
  while (looked_ < known_.size() && known_.size() < kMostPatches) {
    const std::size_t first = looked_;
    looked_ = known_.size();
    parallel_for(first, looked_, [&](std::size_t k) {
      if (const RoomPatch& p = *known_[k].patch; p.lit)
        known_[k].around = find_around(rays_, patches_, p.point + kAirGap_m * p.normal, p.normal, pattern);
    });
    for (std::size_t k = first; k < looked_; ++k)
      for (std::size_t j = 0; j < known_[k].around.size(); ++j)
        number_of(known_[k].around[j].patch);
  }
}

/// E_later = sum F rho (E_first + E_later), Jacobi.
void LampLight::solve() {
  std::vector<Rgb> next(known_.size());
  for (int bounce = 0; bounce < kBounces; ++bounce) {
    parallel_for(tbb::blocked_range<std::size_t>(0, known_.size(), 32), [&](const auto& range) {
      for (std::size_t k = range.begin(); k != range.end(); ++k)
        next[k] = irradiance(known_[k].around, known_[k].around);
    });
    float change = 0.0f, brightest = 0.0f;
    for (std::size_t k = 0; k < known_.size(); ++k) {
      Rgb& later = known_[k].patch->lamp_later;
      change = std::max(change, luminance(glm::abs(next[k] - later)));
      brightest = std::max(brightest, luminance(glm::abs(next[k])));
      later = next[k];
    }
    if (change <= kSettled * brightest)
      return;
  }
}

void LampLight::set_lamps(const ObjectSurface& surface) {
  for (Known& k : known_)
    k.lamp = k.patch->lamp_first = k.patch->lamp_later = Rgb(0.0f);
  lamps_ = std::ranges::any_of(surface.emission, [](const Rgb& e) { return e != Rgb(0.0f); });
  if (!lamps_)
    return;
  shoot(surface);
  find_all();
  set_changes({}, {});
}

/// sum cos dw rho / pi (E_later + E_first where it is far).
Rgb LampLight::irradiance(std::span<const SeenPatch> all, std::span<const SeenPatch> far) {
  Rgb sum(0.0f);
  for (const SeenPatch& s : all)
    sum += s.weight * s.patch->reflectance * s.patch->lamp_later;
  for (const SeenPatch& s : far)
    sum += s.weight * s.patch->reflectance * s.patch->lamp_first;
  return sum * std::numbers::inv_pi_v<float>;
}

/// L_lm = sum dw Y_lm rho / pi E over even directions.
Sh9Rgb LampLight::at_part(std::size_t part, const glm::dvec3& x) const {
  constexpr float kWeight = 4.0f / kPartDirections; // 4 pi sr, over pi
  const BoundingSphere& sphere = parts_.sphere(part);
  Sh9Rgb sum{};
  for (int k = 0; k < kPartDirections; ++k) {
    const glm::dvec2 u = lattice_point(k, kPartDirections);
    const double z = 1.0 - 2.0 * u.x, r = std::sqrt(std::max(0.0, 1.0 - z * z)), turn = 2.0 * std::numbers::pi * u.y;
    const glm::dvec3 w(r * std::cos(turn), r * std::sin(turn), z);
    RayHit hit;
    if (!rays_.closest(rays_.to_local(x), glm::vec3(w), 0.0f, std::numeric_limits<float>::infinity(), hit))
      continue;
    const auto distance = static_cast<double>(hit.distance);
    if (parts_.hidden(x, w, distance, part))
      continue;
    const RoomPatch& patch = *patches_.at(hit.triangle, x + distance * w, w);
    const bool is_near = glm::length(x + distance * w - sphere.centre) < kFeedbackRadii * sphere.radius;
    const Rgb light = kWeight * patch.reflectance * (patch.lamp_later + (is_near ? Rgb(0.0f) : patch.lamp_first));
    const std::array<float, 9> y = sh::evaluate9(glm::vec3(w));
    for (std::size_t i = 0; i < 9; ++i)
      sum[i] += y[i] * light;
  }
  return sum;
}

} // namespace daylit
