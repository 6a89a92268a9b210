#pragma once

#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include "scene/image/rgb_image.h"

namespace daylit {

/// Less of a pixel than this shows no object: half a code value of 255.
constexpr float kLeastCoverage = 1.0f / 510.0f;

/// |after - before| > threshold max(|before|, |after|) in some channel.
inline bool exceeds(const Rgb& before, const Rgb& after, float threshold) {
  const glm::bvec3 differs =
      glm::greaterThan(glm::abs(after - before), threshold * glm::max(glm::abs(before), glm::abs(after)));
  return differs.x | differs.y | differs.z; // no branch: it would be guessed wrong at every faint edge
}

} // namespace daylit
