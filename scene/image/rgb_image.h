#pragma once

#include <cstddef>
#include <vector>

#include <glm/vec3.hpp>

namespace daylit {

/// Linear RGB, Rec. 709 primaries. Whether it is a radiance, an irradiance or a reflectance is said by the name of
/// the variable that holds it.
using Rgb = glm::vec3;

/// Rec. 709 luminance weight of linear RGB.
inline float luminance(const Rgb& c) { return 0.2126f * c.r + 0.7152f * c.g + 0.0722f * c.b; }

/// Row-major linear RGB, top row first. Invariant: texels.size() == width * height.
struct RgbImage {
  int width = 0;
  int height = 0;
  std::vector<Rgb> texels;

  RgbImage() = default;
  RgbImage(int width_px, int height_px, Rgb fill = Rgb(0.0f))
      : width(width_px), height(height_px), texels(static_cast<std::size_t>(width_px) * height_px, fill) {}

  Rgb& at(int x, int y) { return texels[static_cast<std::size_t>(y) * width + x]; }
  const Rgb& at(int x, int y) const { return texels[static_cast<std::size_t>(y) * width + x]; }
  bool empty() const { return texels.empty(); }
};

} // namespace daylit
