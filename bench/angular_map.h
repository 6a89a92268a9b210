#pragma once

// Test images for the lobe maps: a light probe stored as a vertical cross of cube faces, resampled.

#include <cstddef>
#include <functional>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/image/rgb_image.h"

namespace daylit::bench {

/// Radiance of a vertical cross (3 x 4 faces: top; left, front, right; bottom; back turned by 180 degrees) in a
/// direction of the frame x right, y up, z forward. Bilinear within a face.
Rgb sample_cross(const RgbImage& cross, const glm::dvec3& direction);

/// Pixels of an angular map (unit circle in the square, radius = angle from the forward axis / pi) with forward = +z,
/// so that the eight mirror images of a pixel share their z to the last bit.
struct AngularMap {
  std::vector<double> x, y, z;     ///< direction of every pixel inside the circle, row by row
  std::vector<double> solid_angle; ///< (2 pi / side)^2 sin(theta) / theta
  std::vector<double> values;      ///< radiance, 3 per pixel
  std::vector<int> column, row;
};
/// Mean of 16 directions of each pixel.
AngularMap angular_map(const std::function<Rgb(const glm::dvec3&)>& radiance, int side);
AngularMap angular_map(const RgbImage& cross, int side);

/// Equirectangular image, z of the cross frame forward at the centre, rows of width x 3 floats.
std::vector<float> equirectangular_map(const RgbImage& cross, int width, int height);

} // namespace daylit::bench
