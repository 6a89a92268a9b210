#pragma once

// The slow twin of a compact basis: its factors number by number, as docs/volume-format.md defines them.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/volume/compact_basis.h"

namespace daylit::test {

/// A number of a component: a byte, or a word of two.
inline double component_value(const CompactFactors::Brick& b, std::size_t k, std::span<const std::int8_t> numbers,
                              const auto& place_of_plane) {
  const auto at = [&](std::size_t plane) { return double(numbers[place_of_plane(plane)]); };
  return k < b.word_rank ? 256 * at(k) + at(b.word_rank + k) : at(b.word_rank + k);
}

/// Light on a source, or on a group of them.
inline glm::dvec3 light_on_piece(const CompactBasis& basis, std::span<const Rgb> light, std::uint32_t piece) {
  if (piece < basis.sources)
    return glm::dvec3(light[piece]);
  const CompactBasis::Group& g = basis.group[piece - basis.sources];
  glm::dvec3 sum(0.0);
  for (std::uint32_t s = g.first; s < g.end; ++s)
    sum += double(basis.group_weight[s]) * glm::dvec3(light[s]);
  return sum;
}

/// field[probe] = sum_k probe_factor scale_k sum_piece source_factor light_piece.
inline std::vector<std::array<Rgb, 9>> plain_field(const CompactBasis& basis, const CompactFactors& f,
                                                   std::span<const Rgb> radiance, std::size_t probes) {
  const std::vector<Rgb> light = received(basis.light, basis.sources, radiance);
  std::vector<std::array<glm::dvec3, 9>> field(probes);
  std::size_t first_probe = 0, first_piece = 0, component = 0, source = 0, probe = 0;
  for (const CompactFactors::Brick& b : f.brick) {
    const auto sources = std::span(f.source_factor).subspan(source), numbers = std::span(f.probe_factor).subspan(probe);
    for (std::size_t k = 0; k < b.rank(); ++k) {
      glm::dvec3 amplitude(0.0);
      for (std::size_t i = 0; i < b.pieces; ++i)
        amplitude += component_value(b, k, sources, [&](std::size_t plane) { return b.source_at(plane, i); }) *
                     light_on_piece(basis, light, f.piece[first_piece + i]);
      amplitude *= double(f.scale[component + k]);
      for (std::size_t n = 0; n < 9 * std::size_t{b.probes}; ++n)
        for (std::size_t c = 0; c < 3; ++c)
          field[f.probe[first_probe + n / 9]][n % 9][int(c)] +=
              component_value(b, k, numbers, [&](std::size_t plane) { return b.probe_at(plane, c, n); }) *
              amplitude[int(c)];
    }
    first_probe += b.probes;
    first_piece += b.pieces;
    component += b.rank();
    source += b.source_bytes();
    probe += b.probe_bytes();
  }
  std::vector<std::array<Rgb, 9>> out(probes);
  for (std::size_t p = 0; p < probes; ++p)
    std::ranges::transform(field[p], out[p].begin(), [](const glm::dvec3& x) { return Rgb(x); });
  return out;
}

} // namespace daylit::test
