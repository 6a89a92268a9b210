#pragma once

#include <cstdint>
#include <cstring>

#include "scene/image/rgb_image.h"

namespace daylit {

/// Whether a picture is the one of the frame before: by its number where the source gives one, else by its bits.
class PictureMemory {
public:
  /// `context`: another one makes another picture. Remembers what it is given.
  bool same_as(const RgbImage& image, std::uint64_t number, const void* context) {
    const bool same_frame = known_ && context == context_ && image.width == width_ && image.height == height_;
    bool same = same_frame && number != 0 && number == number_;
    if (number == 0) {
      same = same_frame && copy_.texels.size() == image.texels.size() &&
             std::memcmp(copy_.texels.data(), image.texels.data(), image.texels.size() * sizeof(Rgb)) == 0;
      if (!same)
        copy_ = image;
    }
    known_ = true;
    context_ = context;
    number_ = number;
    width_ = image.width;
    height_ = image.height;
    return same;
  }

private:
  RgbImage copy_; ///< kept only for pictures without a number
  bool known_ = false;
  const void* context_ = nullptr;
  std::uint64_t number_ = 0;
  int width_ = 0, height_ = 0;
};

} // namespace daylit
