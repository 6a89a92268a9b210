#pragma once

// Where in their lobes the rays of a pixel go: points of the unit square, the same in every frame, so that a still
// scene does not flicker.

#include <bit>
#include <cstdint>

#include <glm/common.hpp>
#include <glm/vec2.hpp>

namespace daylit {

/// Rays of the lobe at a pixel, if there is one ray of the camera.
constexpr int kLobeRays = 4;

/// PCG as a hash (Jarzynski and Olano 2020).
inline std::uint32_t pcg_hash(std::uint32_t v) {
  v = v * 747796405u + 2891336453u;
  v = ((v >> ((v >> 28u) + 4u)) ^ v) * 277803737u;
  return (v >> 22u) ^ v;
}

/// Of sixteen, each once in a square of four by four pixels.
inline int pattern_of(int x, int y) { return ((x & 3) + 4 * (y & 3)) * 5 & 15; }

/// -0.5 to 0.5 in both, unlike in all other pixels: noise in lines (interleaved gradients) shows as lines.
inline glm::vec2 shift_of(int x, int y) {
  const std::uint32_t u = pcg_hash(static_cast<std::uint32_t>(x) + pcg_hash(static_cast<std::uint32_t>(y))),
                      v = pcg_hash(u);
  return glm::vec2(u, v) * 0x1p-32f - 0.5f;
}

/// Number `sample` of four: sixty-four points of Hammersley 1960, dealt out so that the four of a pixel lie apart and a
/// square of four by four pixels has all. In each pixel they are moved by as much as they lie apart (Cranley and
/// Patterson 1976): else each of the sixty-four shows an image of its own, side by side with the next. `turn`: 0 to 15,
/// another four of them.
inline glm::vec2 lobe_place(int x, int y, int sample, int turn = 0) {
  constexpr float kApart = 0.125f; // between neighbours of sixty-four points in the unit square
  const int n = kLobeRays * kLobeRays * sample + ((pattern_of(x, y) + sample + turn) & 15);
  int mirrored = 0;
  for (int bit = 0; bit < 6; ++bit)
    mirrored |= (n >> bit & 1) << (5 - bit);
  return glm::fract((glm::vec2(n, mirrored) + 0.5f) / 64.0f + kApart * shift_of(x, y));
}

/// Of a ray that went to `place` in its first lobe, in the lobe after `lobes` of them: independent of those before. At
/// a fixed step from the first only few of all pairs of directions would occur.
inline glm::vec2 place_after(const glm::vec2& place, int lobes) {
  if (lobes == 0)
    return place;
  const std::uint32_t u = pcg_hash(std::bit_cast<std::uint32_t>(place.x) +
                                   pcg_hash(std::bit_cast<std::uint32_t>(place.y) + static_cast<std::uint32_t>(lobes)));
  return glm::vec2(u >> 8u, pcg_hash(u) >> 8u) * 0x1p-24f;
}

} // namespace daylit
