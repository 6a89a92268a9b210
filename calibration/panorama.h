#pragma once

// All directions in one map, from pictures whose orientations and exposures are known.

#include <memory>
#include <span>
#include <vector>

#include "calibration/hand_held_list.h"
#include "scene/sky/sky_image.h"

namespace daylit::calibration {

/// A part of the sphere that no picture shows.
struct Gap {
  glm::dvec3 middle; ///< direction
  double solid_angle_sr;
};

struct Panorama {
  RgbImage radiance;
  std::vector<std::uint8_t> seen; ///< pictures that show each texel, at most 255; 0: filled from around
  double coverage = 0.0;          ///< of the sphere
  double over_range = 0.0;        ///< of the map's light: in texels that every picture has saturated
  std::vector<Gap> gaps;          ///< largest first
};

/// Each texel is the mean over its area, of pictures weighted with the inverse variance of their radiance (as
/// BracketMerger), falling to zero towards a picture's edge and towards saturation. Where all pictures are saturated
/// the shortest exposure gives the bound. Gaps are filled with what surrounds them (Gortler et al. 1996, push-pull).
/// Error: interrupted.
Result<Panorama> merge_panorama(std::span<const HandHeldPicture> pictures, const SkyGeometry& geometry,
                                const Progress& progress);

} // namespace daylit::calibration
