#include "precompute/detail/seen_parts.h"

#include <algorithm>
#include <cmath>

namespace daylit::precompute::detail {

namespace {

/// One of each patch, or of each element that is a part.
void find_lit(const SurfaceLight& light, std::span<const float> cluster_fraction, SeenParts& seen) {
  seen.fraction.resize(light.source.size());
  std::uint32_t s = 0;
  for (std::uint32_t k = 0; k < seen.part.size(); ++k) {
    const SeenParts::Part& p = seen.part[k];
    while (s < light.source.size() && light.source[s] < p.end) {
      const std::uint32_t first = s, patch = light.parent[light.source[s]];
      for (; s < light.source.size() && light.source[s] < p.end && light.parent[light.source[s]] == patch; ++s)
        seen.fraction[s] = p.is_element() ? 1.0f : light.element_fraction[light.source[s]];
      seen.lit.push_back({k, light.cluster[first], cluster_fraction[first] / seen.fraction[first], first, s,
                          light.reflectance[first]});
    }
  }
}

} // namespace

/// Neighbouring elements of one patch are one part unless they are distinguished, and so are all of patches that are
/// not seen: what these give comes from the clusters' means alone.
SeenParts SeenParts::of(const SurfaceLight& light, std::span<const float> cluster_fraction,
                        std::span<const Sight> sight) {
  const auto together = [&](std::uint32_t a, std::uint32_t b) {
    const std::uint32_t p = light.parent[a], q = light.parent[b];
    return p == q ? sight[p] != Sight::of_elements : sight[p] == Sight::none && sight[q] == Sight::none;
  };
  SeenParts seen;
  for (std::uint32_t first = 0, end = 0; first < light.elements; first = end) {
    while (++end < light.elements && together(end - 1, end)) {
    }
    seen.part.push_back({light.parent[first], first, end});
    seen.end.push_back(end);
  }
  find_lit(light, cluster_fraction, seen);
  return seen;
}

/// mean[k] = sum over the elements of part k of area fraction x value
std::vector<float> SeenParts::means(const SurfaceLight& light, std::span<const float> of_elements,
                                    std::size_t columns) const {
  std::vector<float> mean(part.size() * columns, 0.0f);
  for (std::size_t k = 0; k < part.size(); ++k)
    for (std::size_t i = part[k].first; i < part[k].end; ++i) {
      const float weight = part[k].is_element() ? 1.0f : light.element_fraction[i];
      for (std::size_t c = 0; c < columns; ++c)
        mean[k * columns + c] += weight * of_elements[i * columns + c];
    }
  return mean;
}

/// The sample of part a is sum over s in a of fraction_s sigma_s sample_s: E_a = sum of fraction_s E_s, the mean
/// irradiance of the part, and M is the covariance of E.
SunMetric SeenParts::metric(const SunMetric& of_sources) const {
  const std::size_t columns = of_sources.columns;
  const float scale = std::sqrt(static_cast<float>(columns));
  std::vector<float> sample(lit.size() * columns, 0.0f);
  for (std::size_t a = 0; a < lit.size(); ++a)
    for (std::size_t s = lit[a].first; s < lit[a].end; ++s) {
      const float unit = scale * fraction[s] * of_sources.sigma[s];
      for (std::size_t k = 0; k < columns; ++k)
        sample[a * columns + k] += unit * of_sources.sample[s * columns + k];
    }
  return {std::move(sample), columns};
}

/// irradiance[a] = sum over s in a of fraction_s sigma_s irradiance_s / sigma_a
std::vector<float> SeenParts::suns(const SunMetric& own, const SunMetric& of_sources, std::span<const float> suns,
                                   std::size_t columns) const {
  std::vector<float> out(lit.size() * columns, 0.0f);
  for (std::size_t a = 0; a < lit.size(); ++a)
    for (std::size_t s = lit[a].first; s < lit[a].end; ++s)
      for (std::size_t c = 0; c < columns; ++c)
        out[a * columns + c] += fraction[s] * of_sources.sigma[s] / own.sigma[a] * suns[s * columns + c];
  return out;
}

/// row_s = fraction_s row_a for every source s of part a
std::vector<float> SeenParts::expand(std::span<const float> rows) const {
  const std::size_t count = lit.empty() ? 0 : rows.size() / lit.size();
  std::vector<float> out(count * fraction.size(), 0.0f);
  for (std::size_t r = 0; r < count; ++r)
    for (std::size_t a = 0; a < lit.size(); ++a)
      for (std::size_t s = lit[a].first; s < lit[a].end; ++s)
        out[r * fraction.size() + s] = fraction[s] * rows[r * lit.size() + a];
  return out;
}

} // namespace daylit::precompute::detail
