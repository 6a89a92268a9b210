#include "scene/volume/linear_radiance.h"

#include <cmath>
#include <map>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace daylit {

namespace {

constexpr double kSame_m = 1e-4;     // corners, and
constexpr double kSameNormal = 1e-3; // normals that count as one

/// Position and plane of a corner.
using CornerKey = std::array<std::int64_t, 6>;

CornerKey key_of(const glm::dvec3& corner, const glm::dvec3& normal) {
  CornerKey key;
  for (int k = 0; k < 3; ++k) {
    key[static_cast<std::size_t>(k)] = std::llround(corner[k] / kSame_m);
    key[static_cast<std::size_t>(k) + 3] = std::llround(normal[k] / kSameNormal);
  }
  return key;
}

} // namespace

LinearRadiance::LinearRadiance(std::span<const FirstReflection::Element> elements, std::span<const Rgb> mean)
    : corner_(elements.size()), mean_(mean.begin(), mean.end()) {
  std::map<CornerKey, std::uint32_t> known;
  std::vector<float> count;
  for (std::size_t e = 0; e < elements.size(); ++e)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto id = known.emplace(key_of(elements[e].corner[k], elements[e].normal), count.size()).first->second;
      if (id == count.size()) {
        count.push_back(0.0f);
        at_corner_.emplace_back(0.0f);
      }
      corner_[e][k] = id;
      count[id] += 1.0f;
      at_corner_[id] += mean[e];
    }
  for (std::size_t c = 0; c < count.size(); ++c)
    at_corner_[c] /= count[c];
}

/// L_e + sum_k (b_k - 1/3) L_k, b: barycentric.
Rgb LinearRadiance::at(std::size_t index, const FirstReflection::Element& element, const glm::dvec3& point) const {
  const glm::dvec3 &a = element.corner[0], &b = element.corner[1], &c = element.corner[2];
  const glm::dvec3 across = glm::cross(b - a, c - a);
  const double whole = glm::dot(across, across);
  const double v = glm::dot(glm::cross(point - a, c - a), across) / whole,
               w = glm::dot(glm::cross(b - a, point - a), across) / whole;
  const double weight[3] = {1.0 - v - w, v, w};
  Rgb radiance = mean_[index];
  for (std::size_t k = 0; k < 3; ++k)
    radiance += static_cast<float>(weight[k] - 1.0 / 3.0) * at_corner_[corner_[index][k]];
  return glm::max(radiance, Rgb(0.0f));
}

} // namespace daylit
