#pragma once

// Exact decisions about single pairs of patches: does any of a few obstacles stand between the two, does one hide
// them from each other entirely?

#include <cstdint>
#include <vector>

#include "radiosity/detail/obstacles.h"
#include "radiosity/detail/pair_kernel.h"
#include "radiosity/polygon_kernel.h"

namespace daylit::radiosity {

enum PairShadow : std::int32_t {
  kClearPair = 0,  ///< no segment between the two meets an obstacle
  kHiddenPair = 1, ///< every segment between the two meets one and the same obstacle
  kMixedPair = 2,  ///< neither could be shown
};

/// The obstacles of one tile of pairs, seen from all patches of the tile's columns. A segment meets a convex polygon
/// or passes on the outer side of one of its edges; both are decided for all segments between two triangles by the
/// nine between their corners, because the crossing point is a projective map of either end.
class PairShadows {
public:
  /// `obstacles`: in the frame of `arrays` (shifted by `shift`); columns [first, last).
  PairShadows(const PairArrays& arrays, const std::vector<Obstacle>& obstacles, const std::vector<std::uint32_t>& used,
              const glm::dvec3& shift, std::uint32_t first, std::uint32_t last, float tolerance_m);

  /// shadow[j - first] of patch i with every column j.
  void row(std::uint32_t i, std::int32_t* shadow);

  /// No segment between two polygons of at most four corners (unshifted coordinates) meets an obstacle: for patches of
  /// which only parts face each other.
  bool clear(const SmallPolygon& a, const SmallPolygon& b) const;

private:
  /// Heights over one plane of the three corners of every column.
  using Heights = std::vector<float>; ///< [corner][column]
  struct Plane {
    float x, y, z, offset;
    float at(float px, float py, float pz) const { return x * px + y * py + z * pz - offset; }
  };
  struct Prepared {
    Plane plane;
    Heights height;
    std::vector<Plane> edge; ///< positive inside
    std::vector<Heights> inside;
  };
  Heights heights(const Plane& p) const;
  void one_obstacle(const Prepared& o, std::uint32_t i, std::int32_t* shadow);
  bool cut_pair_is_clear(const Prepared& o, std::uint32_t i, std::uint32_t j) const;

  const PairArrays& arrays_;
  glm::dvec3 shift_;
  std::uint32_t first_, count_;
  float tolerance_;
  std::vector<Prepared> obstacles_;
  std::vector<std::int32_t> side_, outside_, inside_; ///< of the obstacle in hand, per column
};

} // namespace daylit::radiosity
