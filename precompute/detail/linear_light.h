#pragma once

// Light that is solved on patches, as it is likely to run within each: what falls on a patch beside a corner changes by
// a tenth from its one end to the other, and probes close above it see which end.

#include <cstdint>
#include <span>
#include <vector>

#include "radiosity/patches.h"
#include "radiosity/surface_mesh.h"
#include "scene/room/ray_scene.h"

namespace daylit::precompute::detail {

/// A sparse matrix [element][patch] whose rows add up to 1: the value of the element's patch, and the slope there times
/// the way from the middle of the patch to that of the element. The slope is that of the plane through the patch that
/// is closest to its neighbours (weighted least squares, as for finite volumes: Barth & Jespersen 1989): patches of the
/// same surface that share a corner with it, nothing between them. The mean over the elements of a patch is its value.
class LinearLight {
public:
  struct Share {
    std::uint32_t patch;
    float weight;
  };

  LinearLight() = default;
  /// `parent`: patch of each element, rising. `room`: its reflecting surfaces.
  LinearLight(const radiosity::SurfaceMesh& mesh, std::span<const radiosity::Patch> patches,
              std::span<const radiosity::Patch> elements, std::span<const std::uint32_t> parent, const RayScene& room);

  bool empty() const { return begin_.empty(); }
  std::span<const Share> of(std::size_t element) const {
    return std::span(share_).subspan(begin_[element], begin_[element + 1] - begin_[element]);
  }

private:
  std::vector<Share> share_;
  std::vector<std::size_t> begin_;
};

} // namespace daylit::precompute::detail
