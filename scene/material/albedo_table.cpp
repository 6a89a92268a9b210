#include "scene/material/albedo_table.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
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
constexpr int kCosines = 32;
constexpr float kLeastCosine = 1e-4f; // stands for 0
constexpr float kIndexSteps = 256.0f, kMostIndex = 4.0f;

/// Slopes have their nodes evenly in this.
float rough_coordinate(float alpha) { return std::sqrt(std::sqrt(alpha)); }
const float kLeastRough = rough_coordinate(kLeastAlpha);

float most(const Ggx& facets) { return std::max(facets.alpha_u, facets.alpha_v); }
float least(const Ggx& facets) { return std::min(facets.alpha_u, facets.alpha_v); }

/// `along_u`: cosine of the azimuth.
glm::vec3 direction(float cosine, float along_u) {
  const float sine = std::sqrt(std::max(0.0f, (1.0f - cosine) * (1.0f + cosine)));
  return {sine * along_u, sine * std::sqrt(std::max(0.0f, (1.0f - along_u) * (1.0f + along_u))), cosine};
}

/// Node of an axis from 0 to 1 (the end, where it has but one); middle of a step of one.
float node(int i, int count) { return count == 1 ? 1.0f : static_cast<float>(i) / static_cast<float>(count - 1); }
float middle(int i, int count) { return (static_cast<float>(i) + 0.5f) / static_cast<float>(count); }

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

/// Base-2 digits of n behind the point, reversed (van der Corput 1935).
float second_digits(std::uint32_t n) {
  float result = 0.0f, digit = 0.5f;
  for (; n > 0; n >>= 1, digit *= 0.5f)
    result += static_cast<float>(n & 1u) * digit;
  return result;
}

/// Points of Hammersley 1960; more of them where facets are steep: few, but what they send on gets lost.
glm::vec2 mean_over_facets(const Ggx& facets, const glm::vec3& w, float ior, std::uint32_t samples, Facet facet) {
  const auto count = static_cast<float>(samples);
  const float turn = w.y == 0.0f ? 0.5f : 1.0f; // halves of the facets may be mirror images
  glm::vec2 sum(0.0f);
  for (std::uint32_t n = 0; n < samples; ++n) {
    const float x = turn * (static_cast<float>(n) + 0.5f) / count, rest = 1.0f - second_digits(n) - 0.5f / count;
    sum += 2.0f * rest * facet(facets, w, facets.sample_visible(w, {x, 1.0f - rest * rest}), ior);
  }
  return sum / count;
}

/// Slope of the facets in the plane of w and the normal.
float projected_slope(const Ggx& facets, const glm::vec3& w) {
  const float x = facets.alpha_u * w.x, y = facets.alpha_v * w.y, sine2 = w.x * w.x + w.y * w.y;
  return sine2 > 0.0f ? std::sqrt((x * x + y * y) / sine2) : most(facets);
}
/// Cosine of the azimuth from the direction of the larger slope.
float along(const Ggx& facets, const glm::vec3& w) {
  const float sine2 = w.x * w.x + w.y * w.y;
  return sine2 > 0.0f ? std::abs(facets.alpha_u >= facets.alpha_v ? w.x : w.y) / std::sqrt(sine2) : 1.0f;
}

/// Cosines have their nodes where the albedo bends: at those like the slope, where facets begin to hide each other, and
/// towards grazing light, where Fresnel's factor rises. Azimuths, where the smaller slope begins to count.
float coordinate(float cosine, float slope) {
  return 0.5f * std::sqrt(cosine) + 0.5f * cosine * (1.0f + slope) / (cosine + slope);
}
float inverse(float coordinate_of_it, float slope) {
  float low = 0.0f, high = 1.0f;
  for (int n = 0; n < 30; ++n) {
    const float middle = 0.5f * (low + high);
    (coordinate(middle, slope) < coordinate_of_it ? low : high) = middle;
  }
  return high;
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
    : roughs_(anisotropic ? 18 : 32), ratios_(anisotropic ? 8 : 1), azimuths_(anisotropic ? 8 : 1) {
  const Facet facet = two_sided ? dielectric_facet : mirror_facet;
  const std::uint32_t samples = anisotropic ? 256 : 1024;
  if (two_sided)
    fresnel_ = mean_fresnel(ior);
  for (const float n : two_sided ? std::vector{ior, 1.0f / ior} : std::vector{1.0f})
    for (int i = 0; i < roughs_; ++i)
      for (int j = 0; j < ratios_; ++j) {
        const float q = kLeastRough + (1.0f - kLeastRough) * node(i, roughs_);
        const float r = q * q;
        const float s = node(j, ratios_);
        const Ggx facets{r * r, std::max(r * r * s * s, 1e-2f * kLeastAlpha)};
        const std::size_t first = values_.size();
        add_row(facets, [&](const glm::vec3& w) { return mean_over_facets(facets, w, n, samples, facet); });
        means_.push_back(mean_of_row(facets, &values_[first]));
      }
}

/// Between the nodes of one roughness, from `nodes` on.
struct AlbedoTable::Direction {
  Cell cosine, azimuth;
  Direction(const AlbedoTable& table, const Ggx& facets, const glm::vec3& w)
      : cosine(coordinate(std::min(std::abs(w.z), 1.0f), projected_slope(facets, w)), kCosines),
        azimuth(table.azimuths_ == 1 ? 0.0f : coordinate(along(facets, w), least(facets) / most(facets)),
                table.azimuths_) {}
  glm::vec2 between(const glm::vec2* nodes) const {
    const glm::vec2 a = cosine.between(nodes + azimuth.first * kCosines);
    return azimuth.part == 0.0f
               ? a
               : (1.0f - azimuth.part) * a + azimuth.part * cosine.between(nodes + azimuth.last * kCosines);
  }
};

/// Values of one roughness; facets.alpha_u is the larger slope.
template <class Albedo>
void AlbedoTable::add_row(const Ggx& facets, Albedo&& albedo) {
  for (int a = 0; a < azimuths_; ++a) {
    const float along_u = azimuths_ == 1 ? 1.0f : inverse(node(a, azimuths_), facets.alpha_v / facets.alpha_u);
    const float slope = projected_slope(facets, direction(0.0f, along_u));
    for (int k = 0; k < kCosines; ++k) {
      const float cosine = inverse(node(k, kCosines), slope);
      values_.push_back(albedo(direction(std::max(cosine, kLeastCosine), along_u)));
    }
  }
}

// Of the interpolated values, so that what is added for the rest is the rest: the integral of 2 c value(c) and the mean
// over azimuth, midpoint rule in t = sqrt(c).
glm::vec2 AlbedoTable::mean_of_row(const Ggx& facets, const glm::vec2* nodes) const {
  constexpr int kSteps = 256;
  const int turns = azimuths_ == 1 ? 1 : 32;
  glm::vec2 sum(0.0f);
  for (int a = 0; a < turns; ++a) {
    const float along_u = std::cos(0.5f * kPi * middle(a, turns));
    for (int n = 0; n < kSteps; ++n) {
      const float t = middle(n, kSteps);
      sum += 4.0f * t * t * t * Direction(*this, facets, direction(t * t, along_u)).between(nodes);
    }
  }
  return sum / static_cast<float>(turns * kSteps);
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
  const Cell rough((rough_coordinate(most(facets)) - kLeastRough) / (1.0f - kLeastRough), roughs_);
  const Cell ratio(std::sqrt(least(facets) / most(facets)), ratios_);
  const auto at = [&](int r) {
    const std::size_t row = (static_cast<std::size_t>(inside) * roughs_ + r) * ratios_;
    return ratio.part == 0.0f ? take(row + ratio.first)
                              : (1.0f - ratio.part) * take(row + ratio.first) + ratio.part * take(row + ratio.last);
  };
  return (1.0f - rough.part) * at(rough.first) + rough.part * at(rough.last);
}

glm::vec2 AlbedoTable::at(const Ggx& facets, const glm::vec3& w) const {
  const Direction direction(*this, facets, w);
  return over_roughness(facets, w.z < 0.0f && two_sided(), [&](std::size_t row) {
    return direction.between(&values_[row * static_cast<std::size_t>(azimuths_ * kCosines)]);
  });
}

glm::vec2 AlbedoTable::mean(const Ggx& facets, bool inside) const {
  return over_roughness(facets, inside && two_sided(), [&](std::size_t row) { return means_[row]; });
}

} // namespace daylit
