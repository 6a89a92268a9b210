#pragma once

// The sun as its own light: found in the sky image, taken out of the map that is sampled, with its exact energy.

#include <optional>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/image/rgb_image.h"
#include "scene/sky/sky_image.h"
#include "scene/sky/sky_model.h"

namespace daylit {

class Sky;

constexpr double kSunAngularRadius = 0.004650884; ///< radians, 0.533 degrees across

/// A small cluster of pixels that is far brighter than the sky around it.
struct DetectedSun {
  glm::dvec3 direction{0.0, 0.0, 1.0}; ///< unit, energy centroid of the excess radiance
  double cluster_radius = 0.0;         ///< radians around `direction`: the pixels that are replaced by `surround`
  Rgb surround{0.0f};                  ///< mean radiance of the ring around the cluster
  /// Sum of (radiance - surround) x solid angle over the cluster: irradiance on a plane facing the sun. Replacing the
  /// cluster and adding this light keeps the energy of the image exactly.
  Rgb normal_irradiance{0.0f};
  /// Relative deviation of the energy for one of 1 in every pixel: 1 / sqrt(pixels), were they equally bright.
  double noise_fraction = 1.0;
};

/// `directions`: pixel_directions(), which SkyResampler keeps.
/// Empty when the brightest pixel is less than kSunContrast times the ring around it.
std::optional<DetectedSun> find_sun(const SkyImage& sky, const std::vector<glm::vec3>& directions);

constexpr float kSunContrast = 50.0f;

/// Unit direction per pixel, zero outside the field.
std::vector<glm::vec3> pixel_directions(const SkyImage& sky);

/// The disc of a described sun, or that of the sun found in a picture.
std::optional<SunDisc> small_sun(const Sky& sky);

/// k-th of `count` directions that fill the sun's disc evenly (Vogel's spiral), unit.
glm::dvec3 sun_disc_direction(const glm::dvec3& centre, int k, int count);

} // namespace daylit
