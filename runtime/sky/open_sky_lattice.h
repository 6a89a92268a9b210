#pragma once

// What a cell shows of the sky changes little over an object: a texel of its map is about as large as the cell. Points
// that stand close together therefore use the same look-ups at a lattice no wider than half a cell, trilinear between.

#include <optional>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "runtime/sky/open_sky_kernels.h"

namespace daylit::open_sky {

/// Radiance of a map at a texel position, bilinear, around the seam and clamped at the poles.
Rgb interpolate(const SkyMap& map, float u, float v);

/// Boxes around points, and radiance x transmittance through each cell at their corners. Positions relative to an
/// origin, metres.
class Lattice {
public:
  /// Empty where the points lie so near a window, or so far apart, that a lattice saves nothing.
  static std::optional<Lattice> around(std::span<const glm::vec3> points, std::span<const SkyMap> pyramid,
                                       std::span<const ApertureCell> cells, const glm::dvec3& origin);

  int box_count() const { return boxes_.x * boxes_.y * boxes_.z; }
  int box_of(const glm::vec3& point) const;
  /// Of a point in that box, 0..1 each.
  glm::vec3 in_box(int box, const glm::vec3& point) const;
  /// Of every cell.
  void box_radiance(int box, std::vector<BoxRadiance>& radiance) const;

private:
  int corner_count() const { return (boxes_.x + 1) * (boxes_.y + 1) * (boxes_.z + 1); }
  glm::ivec3 box_index(int box) const {
    return {box % boxes_.x, box / boxes_.x % boxes_.y, box / (boxes_.x * boxes_.y)};
  }
  glm::vec3 corner_position(int corner) const;
  void look_up(std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells, const glm::dvec3& origin);

  glm::vec3 low_{0.0f};
  float spacing_ = 1.0f;
  glm::ivec3 boxes_{1};
  std::vector<Rgb> radiance_; ///< cell by cell, corners x first
};

} // namespace daylit::open_sky
