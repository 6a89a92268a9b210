#pragma once

// Pictures on surfaces.

#include <array>
#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include "scene/core/result.h"

namespace daylit {

/// What the numbers of a stored picture mean: colours are encoded as sRGB (IEC 61966-2-1), all else is stored linearly.
enum class TextureCoding { srgb, linear };
/// What lies beyond 0..1.
enum class TextureWrap { repeat, mirror, clamp };

/// A picture of 8 bits per channel as a file holds it: four channels, opaque where the file has no alpha. Row-major,
/// top row first.
struct TexturePicture {
  int width = 0, height = 0;
  std::vector<std::array<std::uint8_t, 4>> texels;
};

/// A picture with its halved copies (Williams 1983). Thread-safe to read.
class Texture {
public:
  /// Error value_invalid: empty, or as many texels as the picture does not have.
  static Result<Texture> make(TexturePicture picture, TextureCoding coding, TextureWrap wrap_u = TextureWrap::repeat,
                              TextureWrap wrap_v = TextureWrap::repeat);

  /// Linear values, 0..1, at uv (origin top left): trilinear, averaged over `width_uv` of the picture's sides.
  glm::vec4 at(const glm::vec2& uv, float width_uv = 0.0f) const;
  int width() const;
  int height() const;
  std::size_t bytes() const; ///< of memory

private:
  struct Level {
    int width = 0, height = 0;
    std::vector<std::array<std::uint8_t, 4>> texels; ///< as coded
  };
  glm::vec4 bilinear(const Level& level, const glm::vec2& uv) const;
  std::vector<Level> levels_; ///< the picture first
  TextureCoding coding_ = TextureCoding::linear;
  TextureWrap wrap_u_ = TextureWrap::repeat, wrap_v_ = TextureWrap::repeat;
};

} // namespace daylit
