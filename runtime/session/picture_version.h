#pragma once

#include <cstring>

#include "runtime/session/cached.h"
#include "scene/image/rgb_image.h"

namespace daylit {

/// Tells whether a picture is the one before: by its id where the source gives one, else by its bits.
class PictureVersion {
public:
  /// Grows when the picture differs from the one of the last call. `context`: another one makes another picture.
  Version of(const RgbImage& image, std::uint64_t id, const void* context = nullptr) {
    const bool alike =
        version_ > 0 && context == context_ && image.width == width_ && image.height == height_ && id == id_;
    if (alike && (id != 0 || same_bits(image)))
      return version_;
    if (id == 0)
      copy_ = image;
    context_ = context;
    id_ = id;
    width_ = image.width;
    height_ = image.height;
    return ++version_;
  }

private:
  bool same_bits(const RgbImage& image) const {
    return std::memcmp(copy_.texels.data(), image.texels.data(), image.texels.size() * sizeof(Rgb)) == 0;
  }

  RgbImage copy_; ///< of the last picture, when it had no id
  Version version_ = 0;
  const void* context_ = nullptr;
  std::uint64_t id_ = 0;
  int width_ = 0, height_ = 0;
};

} // namespace daylit
