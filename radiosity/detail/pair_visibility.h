#pragma once

// Visibility of many pairs of patches, by rays.

#include <array>
#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include "radiosity/detail/pair_kernel.h"
#include "radiosity/detail/pair_lanes.h"
#include "radiosity/polygon_kernel.h"
#include "scene/room/ray_scene.h"

namespace daylit::radiosity {

/// What two patches of which the plane of one cuts the other show of their fronts: triangles, in the coordinates of
/// the ray scene. Rays between whole patches might never meet a narrow part.
struct FacingParts {
  struct Part {
    std::array<std::array<glm::vec3, 3>, 2> triangle;
    std::array<float, 2> area{};
    std::uint32_t count = 0;
  };
  Part from, to;

  /// Of polygons of at most four corners.
  FacingParts(const SmallPolygon& a, const SmallPolygon& b, const glm::dvec3& shift);
};

/// A pair whose visibility is wanted.
struct PairQuery {
  std::uint32_t i, j;      ///< tree positions
  std::uint64_t seed;      ///< of its sample points
  float form_factor;       ///< the larger of F_ij and F_ji, unoccluded, times the larger importance
  bool near;               ///< the kernel varies over the pair
  float visibility = 0;    ///< result: kernel-weighted fraction of the unblocked rays, 0..1
  std::int32_t parts = -1; ///< which of the FacingParts the rays run between; none: the whole triangles
};

/// Low-discrepancy rays in proportion to the form factor, so that every pair adds the same error to its row's sum.
class PairVisibility {
public:
  /// `rays`: per unit of form factor.
  PairVisibility(const PairArrays& arrays, const RayScene& scene, double rays)
      : arrays_(arrays), scene_(scene), rays_(rays) {}

  /// Sets the visibility of every query (at least one); returns the number of rays.
  std::uint64_t resolve(std::vector<PairQuery>& queries, const std::vector<FacingParts>& parts);

private:
  struct Tally {
    float seen = 0, total = 0;
    std::uint32_t blocked = 0;
  };
  void set_triangles(std::size_t lane, const PairQuery& query, std::uint32_t& index);
  void set_lane(std::size_t lane, const PairQuery& query, std::uint32_t index);
  void add_rays(const PairQuery& query, std::size_t slot, std::uint32_t first, std::uint32_t last);
  void flush(const PairQuery& any);
  void shoot(std::size_t lanes);

  const PairArrays& arrays_;
  const RayScene& scene_;
  double rays_;
  const std::vector<FacingParts>* parts_ = nullptr; ///< of the queries in hand
  PairLanes lanes_;
  std::size_t slot_[16];
  std::size_t used_ = 0;
  std::vector<Tally> tally_;
};

} // namespace daylit::radiosity
