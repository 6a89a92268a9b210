#include "scene/material/albedo_table.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>
#include <shared_mutex>
#include <utility>

#include <glm/geometric.hpp>

#include "scene/material/fresnel.h"
#include "scene/material/material.h"

namespace daylit {

namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr int kCosines = 32;                  // their square roots are evenly spaced: denser where light grazes
constexpr float kLeastCosine = 1e-4f;         // stands for 0
constexpr int kSamplesU = 16, kSamplesV = 32; // of the facets that a direction sees
constexpr float kIndexSteps = 1024.0f, kMostIndex = 4.0f;

const float kLeastRoughness = std::sqrt(kLeastAlpha);

glm::vec3 direction(float cosine, float azimuth) {
  const float sine = std::sqrt(std::max(0.0f, (1.0f - cosine) * (1.0f + cosine)));
  return {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
}

/// (1 + lambda(w)) / (1 + lambda(w) + lambda(in)): what a facet sampled as seen from w sends to `in`.
float passed(const Ggx& facets, const glm::vec3& w, const glm::vec3& in) {
  const float own = 1.0f + facets.lambda(w);
  return own / (own + facets.lambda(in));
}

glm::vec2 mirror_facet(const Ggx& facets, const glm::vec3& w, const glm::vec3& h, float) {
  const float c = glm::dot(w, h);
  const glm::vec3 in = 2.0f * c * h - w;
  if (in.z <= 0.0f)
    return glm::vec2(0.0f);
  const float part = passed(facets, w, in), rest = 1.0f - std::clamp(c, 0.0f, 1.0f);
  return {part, part * rest * rest * rest * rest * rest};
}

glm::vec2 dielectric_facet(const Ggx& facets, const glm::vec3& w, const glm::vec3& h, float ior) {
  const float c = glm::dot(w, h);
  const float f = fresnel_dielectric(c, ior);
  glm::vec2 sum(0.0f);
  if (const glm::vec3 in = 2.0f * c * h - w; in.z > 0.0f)
    sum.x = f * passed(facets, w, in);
  if (const auto in = refracted(w, h, ior); in && in->z < 0.0f)
    sum.y = (1.0f - f) * passed(facets, w, *in);
  return sum;
}

/// Of one facet: facets, direction, facet's normal, index behind over in front.
using Facet = glm::vec2 (*)(const Ggx&, const glm::vec3&, const glm::vec3&, float);

glm::vec2 mean_over_facets(const Ggx& facets, const glm::vec3& w, float ior, Facet facet) {
  glm::vec2 sum(0.0f);
  for (int i = 0; i < kSamplesU; ++i)
    for (int j = 0; j < kSamplesV; ++j)
      sum += facet(facets, w, facets.sample_visible(w, {(i + 0.5f) / kSamplesU, (j + 0.5f) / kSamplesV}), ior);
  return sum / static_cast<float>(kSamplesU * kSamplesV);
}

} // namespace

/// Place on an axis of `count` evenly spaced nodes, 0 to 1.
struct AlbedoTable::Cell {
  int first = 0, last = 0;
  float part = 0.0f; ///< of the last
  Cell(float x, int count) {
    const float at = std::clamp(x, 0.0f, 1.0f) * static_cast<float>(count - 1);
    first = std::min(static_cast<int>(at), std::max(0, count - 2));
    last = std::min(first + 1, count - 1);
    part = at - static_cast<float>(first);
  }
  glm::vec2 between(const glm::vec2* nodes) const { return (1.0f - part) * nodes[first] + part * nodes[last]; }
};

AlbedoTable::AlbedoTable(bool anisotropic, float ior, bool two_sided)
    : roughs_(anisotropic ? 16 : 32), ratios_(anisotropic ? 10 : 1), azimuths_(anisotropic ? 8 : 1) {
  const Facet facet = two_sided ? dielectric_facet : mirror_facet;
  if (two_sided)
    fresnel_ = mean_fresnel(ior);
  for (int side = 0; side < (two_sided ? 2 : 1); ++side)
    for (int i = 0; i < roughs_; ++i)
      for (int j = 0; j < ratios_; ++j) {
        const float r = kLeastRoughness + (1.0f - kLeastRoughness) * static_cast<float>(i) / (roughs_ - 1.0f);
        const float s = ratios_ == 1 ? 1.0f : static_cast<float>(j) / (ratios_ - 1.0f);
        const Ggx facets{r * r, std::max(r * r * s * s, 1e-6f)};
        means_.push_back(
            fill([&](const glm::vec3& w) { return mean_over_facets(facets, w, side == 0 ? ior : 1.0f / ior, facet); }));
      }
}

// Appends the values of one roughness. Their mean is that of the interpolated values, so that what is added for the
// rest is the rest: they are linear in t = sqrt(c), 4 times the integral of t^3 value(t), midpoint rule.
template <class Albedo>
glm::vec2 AlbedoTable::fill(Albedo&& albedo) {
  constexpr int kSteps = 16 * (kCosines - 1);
  glm::vec2 mean(0.0f);
  for (int a = 0; a < azimuths_; ++a) {
    const float azimuth = azimuths_ == 1 ? 0.0f : 0.5f * kPi * static_cast<float>(a) / (azimuths_ - 1.0f);
    const std::size_t row = values_.size();
    for (int k = 0; k < kCosines; ++k) {
      const float t = static_cast<float>(k) / (kCosines - 1.0f);
      values_.push_back(albedo(direction(std::max(t * t, kLeastCosine), azimuth)));
    }
    const float weight = azimuths_ == 1 ? 1.0f : (a == 0 || a == azimuths_ - 1 ? 0.5f : 1.0f) / (azimuths_ - 1.0f);
    for (int n = 0; n < kSteps; ++n) {
      const float t = (n + 0.5f) / kSteps;
      mean += weight * 4.0f * t * t * t / kSteps * Cell(t, kCosines).between(&values_[row]);
    }
  }
  return mean;
}

const AlbedoTable& AlbedoTable::mirror(bool anisotropic) {
  static const AlbedoTable isotropic(false, 1.0f, false);
  if (!anisotropic)
    return isotropic;
  static const AlbedoTable stretched(true, 1.0f, false);
  return stretched;
}

const AlbedoTable& AlbedoTable::dielectric(float ior, bool anisotropic) {
  using Key = std::pair<int, bool>;
  static std::map<Key, std::unique_ptr<const AlbedoTable>> kept;
  static std::shared_mutex guard;
  thread_local std::pair<Key, const AlbedoTable*> latest{{-1, false}, nullptr};

  const Key key{static_cast<int>(std::lround(std::clamp(ior, 1.0f, kMostIndex) * kIndexSteps)), anisotropic};
  if (latest.first == key)
    return *latest.second;
  const AlbedoTable* found = nullptr;
  {
    const std::shared_lock lock(guard);
    if (const auto at = kept.find(key); at != kept.end())
      found = at->second.get();
  }
  if (!found) {
    const std::unique_lock lock(guard);
    auto& place = kept[key];
    if (!place)
      place.reset(new AlbedoTable(anisotropic, static_cast<float>(key.first) / kIndexSteps, true));
    found = place.get();
  }
  latest = {key, found};
  return *found;
}

template <class Take>
glm::vec2 AlbedoTable::over_roughness(const Ggx& facets, bool inside, Take&& take) const {
  const float most = std::max(facets.alpha_u, facets.alpha_v), least = std::min(facets.alpha_u, facets.alpha_v);
  const Cell rough((std::sqrt(most) - kLeastRoughness) / (1.0f - kLeastRoughness), roughs_);
  const Cell ratio(std::sqrt(least / most), ratios_);
  const auto at = [&](int r) {
    const std::size_t row = (static_cast<std::size_t>(inside) * roughs_ + r) * ratios_;
    return ratio.part == 0.0f ? take(row + ratio.first)
                              : (1.0f - ratio.part) * take(row + ratio.first) + ratio.part * take(row + ratio.last);
  };
  return (1.0f - rough.part) * at(rough.first) + rough.part * at(rough.last);
}

glm::vec2 AlbedoTable::at(const Ggx& facets, const glm::vec3& w) const {
  const Cell cosine(std::sqrt(std::min(std::abs(w.z), 1.0f)), kCosines);
  const bool along_u = facets.alpha_u >= facets.alpha_v;
  const float angle = azimuths_ == 1 ? 0.0f : std::atan2(std::abs(along_u ? w.y : w.x), std::abs(along_u ? w.x : w.y));
  const Cell azimuth(2.0f / kPi * angle, azimuths_);
  return over_roughness(facets, w.z < 0.0f && two_sided(), [&](std::size_t row) {
    const glm::vec2* nodes = &values_[row * azimuths_ * kCosines];
    const glm::vec2 a = cosine.between(nodes + azimuth.first * kCosines);
    return azimuth.part == 0.0f
               ? a
               : (1.0f - azimuth.part) * a + azimuth.part * cosine.between(nodes + azimuth.last * kCosines);
  });
}

glm::vec2 AlbedoTable::mean(const Ggx& facets, bool inside) const {
  return over_roughness(facets, inside && two_sided(), [&](std::size_t row) { return means_[row]; });
}

} // namespace daylit
