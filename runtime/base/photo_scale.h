#pragma once

#include <glm/mat3x3.hpp>

#include "scene/image/rgb_image.h"

namespace daylit {

/// photograph = scale * colour_matrix * radiance, before the camera's response.
struct PhotoScale {
  double scale = 1.0;
  glm::dmat3 colour_matrix{1.0};
  Rgb apply(const Rgb& radiance) const { return Rgb(scale * (colour_matrix * glm::dvec3(radiance))); }
};

} // namespace daylit
