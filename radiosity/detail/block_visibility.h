#pragma once

#include <cstdint>
#include <vector>

#include "radiosity/elements.h"

namespace daylit::radiosity {

/// Decides for whole blocks of elements whether anything can stand between them: most pairs of a room need no ray.
/// Conservative: `clear` is only true when no reflecting triangle meets the convex hull of the two blocks except
/// by touching it from outside.
class BlockVisibility {
public:
  BlockVisibility(const ElementSet& set, const PatchMesh& mesh, std::size_t block_size);

  bool clear(std::size_t block_a, std::size_t block_b) const;

private:
  struct Box {
    glm::dvec3 lo, hi;
  };
  struct Plane {
    glm::dvec3 point, normal;
    Box bounds; ///< of the plane's patches
  };
  struct Range {
    double low, high; ///< signed distances of a block's corners from a plane
  };
  std::vector<Plane> planes_;
  std::vector<Box> blocks_;
  std::vector<Range> range_; ///< [block][plane]
  double tolerance_m_ = 0;
};

} // namespace daylit::radiosity
