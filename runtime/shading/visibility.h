#pragma once

// What the sampling grid needs from a renderer: the surfaces that pixels show, and which lights points see.

#include <algorithm>
#include <cstdint>
#include <span>

#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "runtime/base/pixel_box.h"
#include "runtime/shading/light_hints.h"
#include "runtime/shading/point_block.h"
#include "scene/image/rgb_image.h"

namespace daylit {

/// A pixel may show an object and, beside or behind it, the room.
enum class Layer : std::uint8_t { object, room };

/// A point that a pixel shows, metres relative to the renderer's origin.
struct PixelSurface {
  bool exists = false;
  bool receives = false; ///< its visibility is to be found; else nothing is lost
  glm::vec3 position{0.0f}, normal{0.0f};
  glm::vec3 start{0.0f}; ///< of its shadow rays
  bool back = false;     ///< the inside of a thin shell
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
  std::span<const glm::ivec2> outline; ///< pixels at the objects' outlines
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
