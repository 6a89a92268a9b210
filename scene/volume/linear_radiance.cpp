#include "scene/volume/linear_radiance.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

#include <glm/geometric.hpp>

namespace daylit {

namespace {

constexpr double kSame_m = 1e-4; // corners that count as one,
constexpr double kSame = 1e-3;   // normals, and reflectances

/// Position, plane and reflectance of a corner.
using CornerKey = std::array<std::int64_t, 9>;

CornerKey key_of(const FirstReflection::Element& e, std::size_t corner) {
  CornerKey key;
  for (int k = 0; k < 3; ++k) {
    const auto at = static_cast<std::size_t>(k);
    key[at] = std::llround(e.corner[corner][k] / kSame_m);
    key[at + 3] = std::llround(e.normal[k] / kSame);
    key[at + 6] = std::llround(static_cast<double>(e.reflectance[k]) / kSame);
  }
  return key;
}

/// L_k <- L + s (L_k - mean of the three), s such that none is below 0.
void keep_mean(const Rgb& mean, std::array<Rgb, 3>& at_corner) {
  const Rgb middle = (at_corner[0] + at_corner[1] + at_corner[2]) / 3.0f;
  for (int c = 0; c < 3; ++c) {
    const float drop = middle[c] - std::min({at_corner[0][c], at_corner[1][c], at_corner[2][c]});
    const float slope = drop > mean[c] ? mean[c] / drop : 1.0f;
    for (Rgb& corner : at_corner)
      corner[c] = std::max(mean[c] + slope * (corner[c] - middle[c]), 0.0f);
  }
}

} // namespace

LinearRadiance::LinearRadiance(std::span<const FirstReflection::Element> elements, std::span<const Rgb> mean)
    : at_corner_(elements.size()) {
  struct Met {
    Rgb sum{0.0f};
    float count = 0.0f;
  };
  std::map<CornerKey, Met> corners;
  std::vector<std::array<const Met*, 3>> of(elements.size());
  for (std::size_t e = 0; e < elements.size(); ++e)
    for (std::size_t k = 0; k < 3; ++k) {
      Met& met = corners[key_of(elements[e], k)];
      met.sum += mean[e];
      met.count += 1.0f;
      of[e][k] = &met;
    }
  for (std::size_t e = 0; e < elements.size(); ++e) {
    for (std::size_t k = 0; k < 3; ++k)
      at_corner_[e][k] = of[e][k]->sum / of[e][k]->count;
    keep_mean(mean[e], at_corner_[e]);
  }
}

/// sum_k b_k L_k, b: barycentric.
Rgb LinearRadiance::at(std::size_t index, const FirstReflection::Element& element, const glm::dvec3& point) const {
  const glm::dvec3 &a = element.corner[0], &b = element.corner[1], &c = element.corner[2];
  const glm::dvec3 across = glm::cross(b - a, c - a);
  const double whole = glm::dot(across, across);
  const double v = glm::dot(glm::cross(point - a, c - a), across) / whole,
               w = glm::dot(glm::cross(b - a, point - a), across) / whole;
  return static_cast<float>(1.0 - v - w) * at_corner_[index][0] + static_cast<float>(v) * at_corner_[index][1] +
         static_cast<float>(w) * at_corner_[index][2];
}

} // namespace daylit
