#include "precompute/detail/seen_parts.h"

#include <algorithm>
#include <cmath>

namespace daylit::precompute::detail {

namespace {

void find_lit(const SurfaceLight& light, SeenParts& seen) {
  seen.share.resize(light.source.size());
  std::uint32_t s = 0;
  for (std::uint32_t k = 0; k < seen.piece.size(); ++k) {
    const SeenParts::Piece& p = seen.piece[k];
    const std::uint32_t first = s;
    for (; s < light.source.size() && light.source[s] < p.end; ++s)
      seen.share[s] = p.end - p.first == 1 ? 1.0f : light.element_fraction[light.source[s]];
    if (s > first)
      seen.lit.push_back(
          {k, light.cluster[first], light.share[first] / seen.share[first], first, s, light.reflectance[first]});
  }
}

} // namespace

SeenParts SeenParts::of(const SurfaceLight& light, std::span<const std::uint8_t> distinguished) {
  SeenParts seen;
  for (std::uint32_t first = 0, end = 0; first < light.elements; first = end) {
    const std::uint32_t patch = light.parent[first];
    while (end < light.elements && light.parent[end] == patch && (end == first || distinguished[patch] == 0))
      ++end;
    seen.piece.push_back({patch, first, end});
    seen.end.push_back(end);
  }
  find_lit(light, seen);
  return seen;
}

std::vector<float> SeenParts::means(const SurfaceLight& light, std::span<const float> of_leaves,
                                     std::size_t columns) const {
  std::vector<float> mean(piece.size() * columns, 0.0f);
  for (std::size_t k = 0; k < piece.size(); ++k)
    for (std::size_t i = piece[k].first; i < piece[k].end; ++i) {
      const float part = piece[k].end - piece[k].first == 1 ? 1.0f : light.element_fraction[i];
      for (std::size_t c = 0; c < columns; ++c)
        mean[k * columns + c] += part * of_leaves[i * columns + c];
    }
  return mean;
}

SunMetric SeenParts::metric(const SunMetric& of_sources) const {
  const std::size_t sources = of_sources.sigma.size(), n = lit.size();
  std::vector<float> unit(sources), sum(sources);
  for (std::size_t s = 0; s < sources; ++s)
    unit[s] = share[s] * of_sources.sigma[s];
  SunMetric own;
  own.sigma.resize(n);
  own.correlation.resize(n * n);
  for (std::size_t a = 0; a < n; ++a) {
    const float* row = of_sources.correlation.data() + lit[a].first * sources;
    if (lit[a].end - lit[a].first > 1) {
      std::ranges::fill(sum, 0.0f);
      for (std::size_t s = lit[a].first; s < lit[a].end; ++s)
        for (std::size_t t = 0; t < sources; ++t)
          sum[t] += unit[s] * of_sources.correlation[s * sources + t];
      row = sum.data();
    }
    const float scale = lit[a].end - lit[a].first > 1 ? 1.0f : unit[lit[a].first];
    for (std::size_t b = a; b < n; ++b) {
      float both = 0;
      for (std::size_t t = lit[b].first; t < lit[b].end; ++t)
        both += unit[t] * row[t];
      own.correlation[a * n + b] = scale * both;
    }
  }
  // By squares, so that whole lines are read and written.
  constexpr std::size_t kSquare = 32;
  for (std::size_t first = 0; first < n; first += kSquare)
    for (std::size_t column = 0; column < first + kSquare && column < n; ++column)
      for (std::size_t a = std::max(first, column + 1); a < std::min(first + kSquare, n); ++a)
        own.correlation[a * n + column] = own.correlation[column * n + a];
  own.normalise();
  return own;
}

std::vector<float> SeenParts::suns(const SunMetric& own, const SunMetric& of_sources, std::span<const float> suns,
                                    std::size_t columns) const {
  std::vector<float> out(lit.size() * columns, 0.0f);
  for (std::size_t a = 0; a < lit.size(); ++a)
    for (std::size_t s = lit[a].first; s < lit[a].end; ++s)
      for (std::size_t c = 0; c < columns; ++c)
        out[a * columns + c] += share[s] * of_sources.sigma[s] / own.sigma[a] * suns[s * columns + c];
  return out;
}

std::vector<float> SeenParts::expand(std::span<const float> rows) const {
  const std::size_t count = lit.empty() ? 0 : rows.size() / lit.size();
  std::vector<float> out(count * share.size(), 0.0f);
  for (std::size_t r = 0; r < count; ++r)
    for (std::size_t a = 0; a < lit.size(); ++a)
      for (std::size_t s = lit[a].first; s < lit[a].end; ++s)
        out[r * share.size() + s] = share[s] * rows[r * lit.size() + a];
  return out;
}

} // namespace daylit::precompute::detail
