#include "precompute/detail/seen_parts.h"

#include <algorithm>

namespace daylit::precompute::detail {

namespace {

void find_lit(const SurfaceLight& light, SeenParts& seen) {
  seen.fraction.resize(light.source.size());
  std::uint32_t s = 0;
  for (std::uint32_t k = 0; k < seen.part.size(); ++k) {
    const SeenParts::Part& p = seen.part[k];
    const std::uint32_t first = s;
    for (; s < light.source.size() && light.source[s] < p.end; ++s)
      seen.fraction[s] = p.is_element() ? 1.0f : light.element_fraction[light.source[s]];
    if (s > first)
      seen.lit.push_back({k, light.cluster[first], light.cluster_fraction[first] / seen.fraction[first], first, s,
                          light.reflectance[first]});
  }
}

/// The upper half of a symmetric matrix to its lower one, by squares, so that whole lines are read and written.
void mirror(std::vector<float>& matrix, std::size_t n) {
  constexpr std::size_t kSquare = 32;
  for (std::size_t first = 0; first < n; first += kSquare)
    for (std::size_t column = 0; column < first + kSquare && column < n; ++column)
      for (std::size_t a = std::max(first, column + 1); a < std::min(first + kSquare, n); ++a)
        matrix[a * n + column] = matrix[column * n + a];
}

} // namespace

/// A patch that is not distinguished is one part, whatever its elements; of others each element is one.
SeenParts SeenParts::of(const SurfaceLight& light, std::span<const std::uint8_t> distinguished) {
  SeenParts seen;
  for (std::uint32_t first = 0, end = 0; first < light.elements; first = end) {
    const std::uint32_t patch = light.parent[first];
    while (end < light.elements && light.parent[end] == patch && (end == first || distinguished[patch] == 0))
      ++end;
    seen.part.push_back({patch, first, end});
    seen.end.push_back(end);
  }
  find_lit(light, seen);
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

/// With u_s = fraction_s sigma_s the covariance of parts a and b is sum over s in a, t in b of u_s u_t correlation_st.
SunMetric SeenParts::metric(const SunMetric& of_sources) const {
  const std::size_t sources = of_sources.sigma.size(), n = lit.size();
  std::vector<float> unit(sources), sum(sources);
  for (std::size_t s = 0; s < sources; ++s)
    unit[s] = fraction[s] * of_sources.sigma[s];
  SunMetric own;
  own.sigma.resize(n);
  own.correlation.resize(n * n);
  for (std::size_t a = 0; a < n; ++a) {
    const float* row = of_sources.correlation.data() + lit[a].first * sources;
    if (lit[a].is_aggregated()) {
      std::ranges::fill(sum, 0.0f);
      for (std::size_t s = lit[a].first; s < lit[a].end; ++s)
        for (std::size_t t = 0; t < sources; ++t)
          sum[t] += unit[s] * of_sources.correlation[s * sources + t];
      row = sum.data();
    }
    const float scale = lit[a].is_aggregated() ? 1.0f : unit[lit[a].first];
    for (std::size_t b = a; b < n; ++b) {
      float both = 0;
      for (std::size_t t = lit[b].first; t < lit[b].end; ++t)
        both += unit[t] * row[t];
      own.correlation[a * n + b] = scale * both;
    }
  }
  mirror(own.correlation, n);
  own.normalise();
  return own;
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
