#pragma once

// The sky as the renderer samples it: an equirectangular map of the whole sphere without its sun, resampled from any
// measured projection, the ground fill included.

#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/sky/sky_image.h"
#include "scene/sky/sun.h"

namespace daylit {

/// Equirectangular radiance, width = 2 * height, centre column along +x, azimuth growing to the left, no rotation:
/// u = 1/2 - atan2(y, x) / 2pi, v = acos(z) / pi. Row-major, top row first.
struct SkyMap {
  int width = 0, height = 0;
  std::vector<Rgb> radiance;

  /// Unit direction of a continuous texel position (column, row); the first texel spans [0, 1)^2.
  glm::dvec3 direction(double column, double row) const;
  /// Continuous texel position of a unit direction, column in [0, width), row in [0, height].
  glm::dvec2 position(const glm::dvec3& unit_direction) const;
  double solid_angle_sr(int row) const;
  const Rgb& at(int column, int row) const { return radiance[static_cast<std::size_t>(row) * width + column]; }
  Rgb interpolate(const glm::dvec3& unit_direction) const; ///< bilinear between texel centres
};

/// Halved copies of a map, level 0 first, each texel the solid-angle mean of the four below.
std::vector<SkyMap> sky_map_pyramid(SkyMap map);
/// The same in place: level 0 is given, the others are made or written over.
void halve_sky_map(std::vector<SkyMap>& levels);

/// Maps the pixels of one sky camera (SkyImage::geometry()) to the texels of a SkyMap. The geometry is computed once;
/// every frame costs one read of the image. Where the image is finer than the map its pixels are averaged, where it is
/// coarser the nearest pixel is taken, and directions outside the field take the ground fill.
class SkyResampler {
public:
  static SkyResampler make(const SkyImage& sky, int map_height = 256);

  /// Unit world direction of each image pixel; zero vector outside the field.
  const std::vector<glm::vec3>& pixel_directions() const { return pixel_direction_; }
  /// The map of a frame; the pixels of `sun`, if any, show the sky around it instead. Giving the map of another frame
  /// saves its memory.
  void resample(const SkyImage& sky, const DetectedSun* sun, SkyMap& map) const;

private:
  static constexpr std::uint32_t kFill = 0xFFFFFFFFu;
  struct Covering {
    std::uint32_t pixel = kFill;
    float fraction = 1.0f; ///< of the texel; those of a texel add up to one
  };
  std::vector<std::uint32_t> find_texels(const SkyImage& sky, const SkyMap& map);
  std::uint32_t nearest_pixel(const SkyImage& sky, const SkyMap& map, std::size_t texel) const;
  void set_fractions(const std::vector<float>& solid_angle_sr);
  template <class Radiance>
  void average(const Radiance& radiance, const SkyImage& sky, SkyMap& map) const;
  int image_width_ = 0, map_height_ = 0;
  std::vector<glm::vec3> pixel_direction_;
  std::vector<std::uint32_t> first_pixel_; ///< per texel: range into covering_
  std::vector<Covering> covering_;
};

bool is_black(const SkyMap& map);

} // namespace daylit
