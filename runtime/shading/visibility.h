#pragma once

// What the sampling grid needs from a renderer: the surfaces that pixels show, and which lights points see.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "runtime/base/lanes.h"
#include "runtime/base/pixel_box.h"
#include "runtime/shading/point_block.h"
#include "scene/image/rgb_image.h"

namespace daylit {

/// Of 64 lights at one point: bits of those that no object blocks, and of those that one does; both of a light that
/// glass weakens, which is never believed of another point.
struct KnownLights {
  std::uint64_t clear = 0, blocked = 0;
};
constexpr std::size_t kLightsPerWord = 64;
inline std::size_t words_for(std::size_t lights) { return (lights + kLightsPerWord - 1) / kLightsPerWord; }

/// Of one light: lanes that see it, and lanes from which it is blocked, both where glass weakens it; of the others
/// nothing is known.
struct LaneVerdict {
  LaneMask clear = 0, blocked = 0;
};

/// Lights that objects take from a set of points.
struct BlockedLights {
  struct Entry {
    std::uint32_t light = 0;
    LaneMask lanes = 0, weakened = 0; ///< that lose all of it, and that glass leaves a part
    std::uint32_t left = 0;           ///< which of `left` that is
  };
  std::vector<Entry> entries;        ///< ascending lights
  std::vector<LaneRgb> left;         ///< the part that glass leaves of a light
  LaneMask lanes = 0;                ///< that lose any
  std::vector<LaneVerdict> verdicts; ///< per light
};
/// Writes the verdicts of the first lanes to the words of their points, one pointer for each.
void write_known_lights(const BlockedLights& blocked, std::span<KnownLights* const> words);

/// What may be believed of the lights at a set of points before any ray is traced: neighbours that agree save rays.
class LightHints {
public:
  /// Nothing is known of so many lights.
  void reset(std::size_t lights) { verdicts_.assign(lights, {}); }
  /// Of a lane: what all neighbours say that know, two at least.
  void believe_agreeing(int lane, std::span<const KnownLights* const> neighbours);
  /// Of all lanes: what all corners of their block say.
  void believe_corners(std::span<const KnownLights* const> corners);
  std::span<const LaneVerdict> verdicts() const { return verdicts_; }
  /// Nothing is left to be traced at these lanes.
  bool know_all(LaneMask lanes) const {
    return std::ranges::all_of(verdicts_, [&](const LaneVerdict& v) { return !(lanes & ~(v.clear | v.blocked)); });
  }

private:
  std::vector<LaneVerdict> verdicts_;
  void believe(LaneMask lanes, std::size_t word, const KnownLights& known);
};

/// A pixel may show an object and, beside or behind it, the room.
enum class Layer : std::uint8_t { object, room };

/// Cosine of the angle, 30 degrees, from which on a corner's normal leaves its facet for a sharp edge.
constexpr float kSharpEdge = 0.866f;

/// A point that a pixel shows, metres relative to the renderer's origin.
struct PixelSurface {
  bool exists = false;
  bool receives = false; ///< its visibility is to be found; else nothing is lost
  glm::vec3 position{0.0f}, normal{0.0f};
  glm::vec3 start{0.0f}; ///< of its shadow rays
  bool back = false;     ///< the inside of a thin shell
  /// Unit normal of an object's facet on that side, at a sharp edge over which the normals run; else zero. Light from
  /// below it is none.
  glm::vec3 sharp_facet{0.0f};
  bool hidden = false; ///< of the room: an object close before it covers the pixel, or some of it
};

/// Fractions of the open sky's irradiance that a point receives past the room, and past room and objects.
struct SkyFractions {
  Rgb past_room{1.0f}, past_both{1.0f};
};

/// Smallest and largest fractions of several points, per channel.
struct FractionRange {
  Rgb low{1.0f}, high{0.0f};
  void include(const Rgb& f) {
    low = glm::min(low, f);
    high = glm::max(high, f);
  }
  float width() const {
    const Rgb d = high - low;
    return std::max({d.r, d.g, d.b});
  }
};

/// Up to sixteen points of a layer, what is believed of the sky's lights at them, and what is then found.
struct PointSet {
  PointBlock points, starts;
  int count = 0;
  LightHints hints;
  BlockedLights blocked;
  SkyFractions sky[kLanes];

  /// Returns the point's lane.
  int add(const PixelSurface& s) {
    points.set(count, s.position, s.normal);
    starts.set(count, s.start, s.normal);
    return count++;
  }
};

/// The picture that a grid is laid over.
struct SampledPicture {
  int columns = 0, rows = 0; ///< of blocks
  PixelBox box;              ///< pixels that are wanted
  float radius = 0.0f;       ///< of a sphere around the objects, metres
  float radius_px = 0.0f;    ///< how large it appears
  std::size_t sky_lights = 0, sun_lights = 0;
  float light_spacing = 0.0f;          ///< mean angle of a light of the sky to the nearest other, radians
  glm::vec3 low{0.0f}, high{0.0f};     ///< box around the objects
  std::span<const glm::ivec2> outline; ///< pixels in which an object ends or bends sharply
};

/// Called from several threads at once.
class Visibility {
public:
  virtual ~Visibility() = default;
  /// What a pixel shows of a layer. `beside_outline`: the room counts although an object hides it.
  virtual PixelSurface surface(Layer layer, int x, int y, bool beside_outline) const = 0;
  /// Finds `set.blocked` and `set.sky` of the lanes in set.points.lanes. Returns the number of rays.
  virtual std::uint64_t see_sky(Layer layer, PointSet& set) const = 0;
  /// Which of the sun's lights that the point faces the objects block, and which of the others the room does: a word
  /// for every 64. Returns the number of rays.
  virtual std::uint64_t see_sun(Layer layer, const PixelSurface& at, std::span<KnownLights> objects,
                                std::span<KnownLights> room) const = 0;

protected:
  Visibility() = default;
  Visibility(const Visibility&) = default;
  Visibility& operator=(const Visibility&) = default;
};

} // namespace daylit
