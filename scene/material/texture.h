#pragma once

// Pictures on surfaces.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>

#include "scene/core/result.h"
#include "scene/image/image_formats.h"
#include "scene/image/rgb_image.h"

namespace daylit {

/// What the numbers of a stored picture mean: colours are encoded as sRGB (IEC 61966-2-1), all else is stored linearly.
enum class TextureCoding { srgb, linear };
/// What lies beyond 0..1.
enum class TextureWrap { repeat, mirror, clamp };

/// A picture with its halved copies (Williams 1983): four bytes per texel of the picture, all copies counted.
/// Thread-safe to read.
class Texture {
public:
  /// Error value_invalid: empty, or as many bytes as the picture does not have.
  static Result<Texture> make(Rgb8Image picture, TextureCoding coding, TextureWrap wrap_u = TextureWrap::repeat,
                              TextureWrap wrap_v = TextureWrap::repeat);

  /// Linear values, 0..1, at uv (origin top left): trilinear, averaged over `width_uv` of the picture's longer side.
  /// Coordinates that are not finite, or beyond 1e9, count as 0.
  Rgb at(const glm::vec2& uv, float width_uv = 0.0f) const;
  int width() const { return levels_.front().width; }
  int height() const { return levels_.front().height; }
  std::size_t bytes() const; ///< of memory

private:
  Texture() = default;
  Rgb texel(const std::uint8_t* code) const;
  Rgb bilinear(const Rgb8Image& level, const glm::vec2& uv) const;
  std::vector<Rgb8Image> levels_;                  ///< as coded, the picture first
  const std::array<float, 256>* linear_ = nullptr; ///< value of each code
  TextureWrap wrap_u_ = TextureWrap::repeat, wrap_v_ = TextureWrap::repeat;
};

} // namespace daylit
