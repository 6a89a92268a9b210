#pragma once

// A sun that does not flicker with the sensor's noise and does not lag behind the clouds.
//
// The sun covers a few pixels, so that their noise hardly averages out within one frame: 1 % per pixel is 0.6 % of its
// energy, which is most of the light where it shines. Frames are averaged for as long as nothing but noise changed.
// The noise is measured from frame to frame; a change beyond four standard deviations of it, or a smaller one that
// lasts, starts a new mean with the frame that shows it: that frame's value is taken as it is.

#include <optional>
#include <vector>

#include "scene/sky/sky_image.h"
#include "scene/sky/sky_partition.h"
#include "scene/sky/sun.h"

namespace daylit {

class SteadySun {
public:
  /// `sun`: what find_sun() measured in this frame. Returns it with the mean energy and direction.
  std::optional<DetectedSun> update(const SkyImage& sky, const std::optional<DetectedSun>& sun);

private:
  void measure_noise(const SkyImage& sky);
  bool is_new(const DetectedSun& sun);

  std::vector<float> last_pixels_; ///< every so many of the frame before
  int width_ = 0, height_ = 0;
  double pixel_noise_ = 0.0;
  std::optional<DetectedSun> mean_;
  int count_ = 0;
  double drift_ = 0.0; ///< weighted mean of the deviations in standard deviations
};

/// Adds a light of the given irradiance on a plane facing it to the mean radiance of the regions.
void add_distant_light(const SkyPartition& partition, const glm::dvec3& direction, const Rgb& irradiance,
                       std::vector<Rgb>& regions);

} // namespace daylit
