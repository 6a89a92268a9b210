#pragma once

// Radiance that varies linearly over each element of a volume: between its corners, at which it is the mean of the
// elements of one plane that meet there (Gouraud 1971; Cohen & Wallace 1993, ch. 9.2). The mean of an element is kept.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/volume/first_reflection.h"

namespace daylit {

class LinearRadiance {
public:
  LinearRadiance() = default;
  /// `mean`: of each element. Copies it.
  LinearRadiance(std::span<const FirstReflection::Element> elements, std::span<const Rgb> mean);

  /// At a point of the element, world metres; never below 0.
  Rgb at(std::size_t index, const FirstReflection::Element& element, const glm::dvec3& point) const;

private:
  std::vector<std::array<std::uint32_t, 3>> corner_; ///< of each element, into at_corner_
  std::vector<Rgb> at_corner_, mean_;
};

} // namespace daylit
