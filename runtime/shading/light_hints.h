#pragma once

// What is known of the lights at points: of each light, whether an object blocks it. Neighbours that agree save rays.

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/base/lanes.h"

namespace daylit {

/// Of 64 lights at one point: bits of those that no object blocks, and of those that one does.
struct KnownLights {
  std::uint64_t clear = 0, blocked = 0;
};
constexpr std::size_t kLightsPerWord = 64;
inline std::size_t words_for(std::size_t lights) { return (lights + kLightsPerWord - 1) / kLightsPerWord; }

/// Of one light: lanes that see it, and lanes from which it is blocked; of the others nothing is known.
struct LaneVerdict {
  LaneMask clear = 0, blocked = 0;
};

/// Lights that objects take from a set of points.
struct BlockedLights {
  struct Entry {
    std::uint32_t light;
    LaneMask lanes;
  };
  std::vector<Entry> entries;        ///< ascending lights
  LaneMask lanes = 0;                ///< that lose any
  std::vector<LaneVerdict> verdicts; ///< per light
};
/// Writes the verdicts of the first lanes to the words of their points, one pointer for each.
void write_known_lights(const BlockedLights& blocked, std::span<KnownLights* const> words);

/// What may be believed of the lights at a set of points before any ray is traced.
class LightHints {
public:
  /// Nothing is known of so many lights.
  void reset(std::size_t lights) { verdicts_.assign(lights, {}); }
  /// Of a lane: what all neighbours say that know, two at least.
  void believe_agreeing(int lane, std::span<const KnownLights* const> neighbours);
  /// Of all lanes: what all corners of their block say.
  void believe_corners(std::span<const KnownLights* const> corners);
  std::span<const LaneVerdict> verdicts() const { return verdicts_; }

private:
  std::vector<LaneVerdict> verdicts_;
  void believe(LaneMask lanes, std::size_t word, const KnownLights& known);
};

} // namespace daylit
