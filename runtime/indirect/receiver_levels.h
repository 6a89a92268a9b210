#pragma once

// How fine the lattices of receiver_lattice.h are, and where one takes over from another.

#include <algorithm>
#include <array>
#include <cstddef>

namespace daylit {

constexpr int kRays = 32, kFarRays = 24; // per object and node
/// How wide cells are and how far they reach, in radii of the smallest object (LitScene::smallest_radii_away()): at
/// `blend_from` the next level sets in, at `blend_to` it has taken over; the last level has none.
struct ReceiverLevel {
  double cell, blend_from, blend_to;
  int rays;
};
/// The first levels reach as far from the objects' surfaces, the others from their spheres.
constexpr std::size_t kContactLevels = 2;
constexpr std::array<ReceiverLevel, 9> kLevels{{{1.0 / 40.0, 0.07, 0.11, kRays},
                                                {1.0 / 18.0, 0.22, 0.30, kRays},
                                                {1.0 / 8.0, 1.1, 1.3, kRays},
                                                {1.0 / 4.0, 1.8, 2.2, kRays},
                                                {1.0 / 2.0, 5.0, 6.5, kRays},
                                                {1.0, 10.0, 13.0, kFarRays},
                                                {2.0, 20.0, 26.0, kFarRays},
                                                {4.0, 40.0, 52.0, kFarRays},
                                                {8.0, 0.0, 0.0, kFarRays}}};
constexpr double kWidestCell_m = 0.5;
constexpr double kSeenRadii = 7.0;       // further from an object a mirror does not show what it changes
constexpr double kMirrorRadii = 0.1;     // a mirror shows the room as if it were no nearer
constexpr double kNarrowestCell_m = 0.1; // a mirror shows the room in no narrower ones than the first so wide
constexpr float kMostStep = 2.0f;        // of the light from corner to corner of a wider one

/// How far from a cell's corner surfaces are looked for, radii: beyond it the next level holds.
constexpr double farthest(std::size_t level) {
  return level < kContactLevels ? kLevels[level].blend_to + 2.0 * kLevels[level].cell : 0.5;
}

/// Which level holds, and how much of the next one is mixed in.
struct LevelMix {
  std::size_t level = kContactLevels;
  float next = 0.0f;
};
/// From that level on; 3 t^2 - 2 t^3, t = (d - from) / (to - from), of the next one: no step where cells grow.
inline LevelMix level_mix(std::size_t level, double away) {
  const std::size_t last = level < kContactLevels ? kContactLevels : kLevels.size() - 1;
  while (level < last && away >= kLevels[level].blend_to)
    ++level;
  const ReceiverLevel& l = kLevels[level];
  const double t = level < last ? std::max(0.0, (away - l.blend_from) / (l.blend_to - l.blend_from)) : 0.0;
  return {level, static_cast<float>(t * t * (3.0 - 2.0 * t))};
}

} // namespace daylit
