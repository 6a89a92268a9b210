#pragma once

// Radiance of the whole sphere, one value per direction, on the octahedral square (runtime/base/octahedral.h).

#include <cstddef>
#include <functional>
#include <numbers>
#include <vector>

#include "runtime/base/octahedral.h"
#include "scene/core/result.h"
#include "scene/image/rgb_image.h"

namespace daylit {

/// Largest side of a map, texels: half a gigabyte of radiance.
inline constexpr int kMaxMapSide = 4096;

/// Radiance from each direction, in the unit of whoever filled it; square, row-major, first row at v = -1.
/// Invariant: radiance.size() == side * side.
struct RadianceMap {
  int side = 0;
  std::vector<Rgb> radiance;

  RadianceMap() = default;
  explicit RadianceMap(int side_texels, Rgb fill = Rgb(0.0f))
      : side(side_texels), radiance(static_cast<std::size_t>(side_texels) * side_texels, fill) {}

  /// Unit direction of a texel's centre.
  glm::dvec3 direction(std::size_t texel) const;
  /// Of every texel, steradians.
  double solid_angle_sr() const { return 4.0 * std::numbers::pi / (static_cast<double>(side) * side); }
  /// The texel that holds a direction of any length above 0.
  std::size_t texel(const glm::dvec3& direction) const;
  /// Bilinear between texel centres, across the folds of the square too; `direction` of any length above 0.
  Rgb lookup(const glm::vec3& direction) const;
  Rgb at(int column, int row) const { return radiance[static_cast<std::size_t>(row) * side + column]; }
  /// The texel that a column or row up to half a side beyond the square stands for.
  Rgb at_folded(int column, int row) const;
};

/// Half the side; each texel is the mean of the four below, which have its solid angle between them. Even sides only.
RadianceMap halved(const RadianceMap& map);

/// What a map may hold: a side from 4 to kMaxMapSide that is a power of two, finite radiance, none below 0.
Result<void> check_map(const RadianceMap& map, const char* where);

/// Mean of radiance(direction) over `samples` x `samples` points of each texel, in parallel: `radiance` is called from
/// several threads. For pictures in other projections: what averaging leaves out is the resampling error.
RadianceMap sampled_map(int side, int samples, const std::function<Rgb(const glm::dvec3&)>& radiance);

} // namespace daylit
