#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

#include "scene/image/image_formats.h"
#include "scene/image/rgb_image.h"

namespace daylit {

/// Linear exposure that each 8-bit code value stands for, per channel.
using ExposureTable = std::array<std::array<float, 256>, 3>;

/// The pixels of a photograph as linear RGB, row-major: of a linear picture as they are, of an 8-bit one looked up when
/// they are asked for, so that three bytes a pixel are kept of it and not fifteen. Refers to what it was made from.
class PhotoPixels {
public:
  PhotoPixels(const RgbImage& linear) // NOLINT: a linear picture is its own pixels
      : linear_(linear.texels.data()), width_(linear.width), height_(linear.height) {}
  PhotoPixels(const Rgb8Image& codes, const ExposureTable& exposure)
      : codes_(codes.bytes.data()), exposure_(&exposure), width_(codes.width), height_(codes.height) {}

  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t size() const { return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_); }
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  Rgb operator[](std::size_t i) const {
    if (linear_)
      return linear_[i];
    const std::uint8_t* code = codes_ + 3 * i;
    return {(*exposure_)[0][code[0]], (*exposure_)[1][code[1]], (*exposure_)[2][code[2]]};
  }
  /// The pixels first .. first + count - 1.
  void read(std::size_t first, std::size_t count, Rgb* out) const {
    for (std::size_t i = 0; i < count; ++i)
      out[i] = (*this)[first + i];
  }
  /// From this value on a channel may stand for anything brighter.
  float white() const {
    return linear_ ? std::numeric_limits<float>::infinity()
                   : std::min({(*exposure_)[0][255], (*exposure_)[1][255], (*exposure_)[2][255]});
  }
  RgbImage copy() const {
    RgbImage image(width_, height_);
    read(0, size(), image.texels.data());
    return image;
  }
  /// Bit for bit.
  bool same_as(const RgbImage& image) const {
    if (image.width != width_ || image.height != height_)
      return false;
    for (std::size_t i = 0; i < size(); ++i)
      if (const Rgb pixel = (*this)[i]; std::memcmp(&pixel, &image.texels[i], sizeof(Rgb)) != 0)
        return false;
    return true;
  }

private:
  const Rgb* linear_ = nullptr;
  const std::uint8_t* codes_ = nullptr;
  const ExposureTable* exposure_ = nullptr;
  int width_ = 0, height_ = 0;
};

} // namespace daylit
