#include "runtime/indirect/sunlit_correction.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/indirect/box_lattice.h"

namespace daylit {

namespace {

constexpr double kInset = 0.1;         // of the box of an object, of the corners from which it is looked
constexpr double kNearSpacings = 2.0;  // fades in from there to twice that
constexpr float kNothingKnown = 1e30f; // 1 / m

/// Part of a point that the room leaves, as eight points about an object see it.
float visible_part(const glm::dvec3& point, std::size_t part, const PlacedParts& parts,
                   const WindowVisibility& windows) {
  const BoxLattice corners(parts.box(part), 2, kInset);
  int seen = 0;
  for (std::size_t k = 0; k < corners.point_count(); ++k)
    seen += windows.visible(parts.to_world(part, corners.position(k)), point);
  return static_cast<float>(seen) / static_cast<float>(corners.point_count());
}

} // namespace

float SurfacesKnown::share_beyond(const glm::dvec3& x) const {
  return reach_m > 0.0 ? static_cast<float>(glm::smoothstep(0.5, 1.0, glm::distance(x, centre) / reach_m)) : 1.0f;
}

SunlitCorrection::Seen::Seen(const glm::dvec3& centre, std::span<const SunlitPoint> seen)
    : origin(centre), blocks((seen.size() + sunlit::kLanes - 1) / sunlit::kLanes), power(seen.size()) {
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const SunlitPoint& p = seen[i];
    const glm::vec3 x(p.position - origin), n(p.normal);
    sunlit::Points& block = blocks[i / sunlit::kLanes];
    const std::size_t k = i % sunlit::kLanes;
    block.x[k] = x.x, block.y[k] = x.y, block.z[k] = x.z;
    block.nx[k] = n.x, block.ny[k] = n.y, block.nz[k] = n.z;
    block.per_reach[k] = static_cast<float>(1.0 / (kNearSpacings * p.spacing_m));
    power[i] = p.power;
  }
}

SunlitCorrection::SunlitCorrection(std::span<const SunlitPoint> points, const PlacedParts& parts,
                                   const WindowVisibility& windows) {
  for (std::size_t part = 0; part < parts.size(); ++part) {
    std::vector<SunlitPoint> seen;
    for (SunlitPoint p : points) {
      p.power *= visible_part(p.position, part, parts, windows);
      if (p.power != Rgb(0.0f))
        seen.push_back(p);
    }
    seen_.emplace_back(parts.sphere(part).centre, seen);
  }
}

/// sum over the points of power cos' / (pi r^2) (V cos - sum_lm Y_lm(w) C_lm): a small diffuse source.
Rgb SunlitCorrection::at(std::size_t part, const glm::dvec3& x, const SenderSide& side,
                         const TransferVector& world_transfer, const SurfacesKnown& known) const {
  const Seen& seen = seen_[part];
  const sunlit::Receiver receiver{glm::vec3(x - seen.origin), side.world_from_local, world_transfer,
                                  glm::vec3(known.centre - seen.origin),
                                  known.reach_m > 0.0 ? static_cast<float>(1.0 / known.reach_m) : kNothingKnown};
  Rgb sum(0.0f);
  sunlit::Views views;
  for (std::size_t i = 0; i < seen.power.size(); ++i) {
    const std::size_t k = i % sunlit::kLanes;
    if (k == 0)
      sunlit::view(seen.blocks[i / sunlit::kLanes], receiver, views);
    if (views.weight[k] <= 0.0f)
      continue;
    const glm::vec3 w(views.x[k], views.y[k], views.z[k]);
    const float cosine = w.z > 0.0f && side.sees(w) ? w.z : 0.0f;
    sum += views.weight[k] * (cosine - views.coefficients[k]) * seen.power[i];
  }
  return sum;
}

} // namespace daylit
