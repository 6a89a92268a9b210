// add_harmonics is compiled once for each set of vector instructions: a plain loop that the compiler makes vectors of.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "radiosity/detail/ray_fan.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "radiosity/detail/ray_fan.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "radiosity/detail/sampling.h"
#include "sh/band4.h"
#include "sh/sh9.h"

HWY_BEFORE_NAMESPACE();
namespace daylit::radiosity {
namespace HWY_NAMESPACE {

void AddHarmonics(const std::int32_t* met, std::size_t rays, const std::uint32_t* aggregate_of, const float* harmonics,
                  float* sum) {
  for (std::size_t k = 0; k < rays; ++k) {
    if (met[k] < 0)
      continue;
    float* to = sum + static_cast<std::size_t>(aggregate_of[met[k]]) * RayFan::kStride;
    for (std::size_t l = 0; l < RayFan::kStride; ++l)
      to[l] += harmonics[k * RayFan::kStride + l];
  }
}

} // namespace HWY_NAMESPACE
} // namespace daylit::radiosity
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace daylit::radiosity {

HWY_EXPORT(AddHarmonics);

namespace {

/// Position on a Z curve over the octahedral map of the sphere: neighbours in it are neighbours in direction.
std::uint32_t position_on_curve(const glm::vec3& d) {
  glm::vec2 p = glm::vec2(d) / (std::abs(d.x) + std::abs(d.y) + std::abs(d.z));
  if (d.z < 0.0f)
    p = (1.0f - glm::vec2(std::abs(p.y), std::abs(p.x))) *
        glm::vec2(std::copysign(1.0f, p.x), std::copysign(1.0f, p.y));
  const auto cell = [](float x) {
    return static_cast<std::uint32_t>(std::clamp(0.5f * x + 0.5f, 0.0f, 1.0f) * 1023.0f);
  };
  const std::uint32_t x = cell(p.x), y = cell(p.y);
  std::uint32_t code = 0;
  for (std::uint32_t bit = 0; bit < 10; ++bit)
    code |= (x >> bit & 1u) << (2 * bit) | (y >> bit & 1u) << (2 * bit + 1);
  return code;
}

} // namespace

RayFan RayFan::of(int rays) {
  const auto n = static_cast<std::uint32_t>(rays);
  std::vector<std::pair<std::uint32_t, glm::vec3>> list;
  for (std::uint32_t k = 0; k < n; ++k) {
    const glm::vec3 d(fibonacci_direction(k, n, {0.5, 0.0}));
    list.emplace_back(position_on_curve(d), d);
  }
  std::ranges::stable_sort(list, {}, &std::pair<std::uint32_t, glm::vec3>::first);
  RayFan fan;
  fan.harmonics.assign(n * kStride, 0.0f);
  fan.band4.assign(n * kStride, 0.0f);
  for (std::size_t k = 0; k < list.size(); ++k) {
    fan.direction.push_back(list[k].second);
    const auto y = sh::evaluate9(list[k].second), y4 = sh::evaluate_band4(list[k].second);
    for (std::size_t l = 0; l < 9; ++l) {
      fan.harmonics[k * kStride + l] = y[l] * 4.0f / static_cast<float>(n);
      fan.band4[k * kStride + l] = y4[l] * 4.0f / static_cast<float>(n);
    }
  }
  return fan;
}

std::array<float, 9> axis_cosines(const glm::vec3& d) {
  std::array<float, 9> cosine{};
  for (int k = 0; k < 6; ++k)
    cosine[static_cast<std::size_t>(k)] = std::max(0.0f, k % 2 == 0 ? d[k / 2] : -d[k / 2]);
  return cosine;
}

std::vector<float> RayFan::axes(const glm::vec2& turn) const {
  std::vector<float> table(harmonics.size(), 0.0f);
  for (std::size_t k = 0; k < direction.size(); ++k) {
    const glm::vec3& d = direction[k];
    const auto cosine = axis_cosines({turn.x * d.x - turn.y * d.y, turn.y * d.x + turn.x * d.y, d.z});
    for (std::size_t l = 0; l < cosine.size(); ++l)
      table[k * kStride + l] = cosine[l] * 4.0f / static_cast<float>(direction.size());
  }
  return table;
}

/// 2 pi times the second coordinate of a hash of the index.
glm::vec2 turn_of(std::size_t point) {
  const double angle = 2.0 * std::numbers::pi * random_shift(point).y;
  return {std::cos(angle), std::sin(angle)};
}

void add_harmonics(std::span<const std::int32_t> met, std::span<const std::uint32_t> aggregate_of,
                   const float* harmonics, float* sum) {
  HWY_DYNAMIC_DISPATCH(AddHarmonics)(met.data(), met.size(), aggregate_of.data(), harmonics, sum);
}

void turn_harmonics(const float* from, const glm::vec2& turn, std::size_t stride, Bands bands, float* to) {
  const float c1 = turn.x, s1 = turn.y, c2 = c1 * c1 - s1 * s1, s2 = 2.0f * c1 * s1;
  const auto pair = [&](std::size_t sine, std::size_t cosine, float c, float s) {
    to[sine * stride] = from[sine] * c + from[cosine] * s;
    to[cosine * stride] = from[cosine] * c - from[sine] * s;
  };
  if (bands == Bands::axes) { // RayFan::axes() has turned them
    for (std::size_t k = 0; k < 9; ++k)
      to[k * stride] = from[k];
    return;
  }
  if (bands == Bands::fourth) {
    to[4 * stride] = from[4];
    pair(3, 5, c1, s1);
    pair(2, 6, c2, s2);
    pair(1, 7, c2 * c1 - s2 * s1, s2 * c1 + c2 * s1);
    pair(0, 8, c2 * c2 - s2 * s2, 2.0f * c2 * s2);
    return;
  }
  to[0] = from[0];
  to[2 * stride] = from[2];
  to[6 * stride] = from[6];
  pair(1, 3, c1, s1);
  pair(5, 7, c1, s1);
  pair(4, 8, c2, s2);
}

} // namespace daylit::radiosity
#endif
