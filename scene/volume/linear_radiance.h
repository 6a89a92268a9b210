#pragma once

// Radiance that varies linearly over each element of a volume: between its corners, at which it is the mean of the
// elements of one plane and reflectance that meet there (Gouraud 1971; Cohen & Wallace 1993, ch. 9.2). The mean of an
// element is kept; its slope is lessened where it would fall below 0, so that a dark element beside a bright one, on
// the other side of a thin wall, is nowhere brighter than three times its mean.

#include <array>
#include <span>
#include <vector>

#include "scene/volume/first_reflection.h"

namespace daylit {

class LinearRadiance {
public:
  LinearRadiance() = default;
  /// `mean`: of each element.
  LinearRadiance(std::span<const FirstReflection::Element> elements, std::span<const Rgb> mean);

  /// At a point of the element, world metres.
  Rgb at(std::size_t index, const FirstReflection::Element& element, const glm::dvec3& point) const;

private:
  std::vector<std::array<Rgb, 3>> at_corner_; ///< of each element
};

} // namespace daylit
