#pragma once

// Directions of light from all of the sky, and the parts of openings that it comes in through.

#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/room/aperture.h"
#include "scene/sky/sky_partition.h"

namespace daylit::radiosity {

/// Directions that stand for the regions of a partition, region after region: the same number for each, one in every
/// square of n x n equal parts of its solid angle and in every row and column of n^2 (Chiu, Shirley & Wang 1994),
/// since the edges of shadows run along the rows of a plain grid.
struct SkyDirections {
  std::vector<glm::dvec3> w; ///< unit
  std::vector<std::int32_t> region;
  std::vector<double> solid_angle_sr; ///< of the part that a direction stands for

  /// At least `count` directions. A node may be its own direction alone, and so may a cell where there are more than
  /// `count`; else a constant region has at least 2 x 2.
  static SkyDirections make(const SkyPartition& partition, int count);
};

/// A convex part of an opening, at most eight corners (metres, relative to the mesh origin).
struct AperturePart {
  std::vector<glm::dvec3> corner;
  glm::dvec3 inward{0.0};
  std::uint32_t aperture = 0;
};
std::vector<AperturePart> aperture_parts(const std::vector<Aperture>& apertures, const glm::dvec3& origin);

/// Directions that come in through one part, one array per coordinate.
struct EnteringDirections {
  std::vector<float> x, y, z;
  std::vector<std::uint32_t> index; ///< in SkyDirections

  /// Of the angles with a unit axis.
  std::vector<float> cosines(const glm::dvec3& axis) const;
};

/// Directions for all of the sky, and which of them come in through each part.
struct SkySweep {
  SkyDirections sky;
  std::vector<EnteringDirections> entering;

  SkySweep(const SkyPartition& partition, const std::vector<AperturePart>& parts, int count);
};

} // namespace daylit::radiosity
