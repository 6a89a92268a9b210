#include "calibration/colour_match.h"

#include <vector>

#include <glm/matrix.hpp>

namespace daylit::calibration {

namespace {

constexpr std::size_t kFewestPatches = 18;

/// M with least sum |M a - b|^2 / |b|^2 over all but one patch: (sum b a^T)(sum a a^T)^-1.
glm::dmat3 fitted(const std::vector<std::array<glm::dvec3, 2>>& pairs, std::size_t without) {
  glm::dmat3 ba(0.0), aa(0.0);
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto& [a, b] = pairs[k];
    if (k == without)
      continue;
    const double weight = 1.0 / glm::dot(b, b);
    ba += weight * glm::outerProduct(b, a);
    aa += weight * glm::outerProduct(a, a);
  }
  return ba * glm::inverse(aa);
}

} // namespace

std::optional<ColourMatch> match_colours(const std::array<ChartPatch, kPatches>& first,
                                         const std::array<ChartPatch, kPatches>& second,
                                         const glm::dmat3& rec709_from_second) {
  std::vector<std::array<glm::dvec3, 2>> pairs;
  glm::dvec3 a(0.0), b(0.0);
  for (std::size_t k = 0; k < kPatches; ++k)
    if (!first[k].saturated && !second[k].saturated && glm::dot(second[k].code, second[k].code) > 0) {
      pairs.push_back({first[k].code, second[k].code});
      a += first[k].code;
      b += second[k].code;
    }
  if (pairs.size() < kFewestPatches)
    return std::nullopt;
  ColourMatch match;
  match.matrix = fitted(pairs, pairs.size());
  const double same = (b.x + b.y + b.z) / (a.x + a.y + a.z);
  const auto difference = [&](const glm::dvec3& p, const glm::dvec3& q) {
    return delta_e_2000(lab_of(rec709_from_second * p), lab_of(rec709_from_second * q)) /
           static_cast<double>(pairs.size());
  };
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    match.before += difference(same * pairs[k][0], pairs[k][1]);
    match.held_out += difference(fitted(pairs, k) * pairs[k][0], pairs[k][1]);
  }
  return match;
}

} // namespace daylit::calibration
