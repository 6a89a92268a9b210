#include "runtime/indirect/sunlit_correction.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/indirect/box_lattice.h"
#include "sh/sh9.h"

namespace daylit {

namespace {

constexpr double kInset = 0.1;        // of the box of an object, of the corners from which it is looked
constexpr double kNearSpacings = 2.0; // fades in from there to twice that

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

SunlitCorrection::SunlitCorrection(std::span<const SunlitPoint> points, const PlacedParts& parts,
                                   const WindowVisibility& windows)
    : seen_(parts.size()) {
  for (std::size_t part = 0; part < parts.size(); ++part)
    for (SunlitPoint p : points) {
      p.power *= visible_part(p.position, part, parts, windows);
      if (p.power != Rgb(0.0f))
        seen_[part].push_back(p);
    }
}

/// sum over the points of power cos' / (pi r^2) (V cos - sum_lm Y_lm(w) C_lm): a small diffuse source.
Rgb SunlitCorrection::at(std::size_t part, const glm::dvec3& x, const SenderSide& side,
                         const TransferVector& world_transfer, const SurfacesKnown& known) const {
  Rgb sum(0.0f);
  for (const SunlitPoint& p : seen_[part]) {
    const glm::dvec3 d = p.position - x;
    const double r = glm::length(d), there = -glm::dot(p.normal, d) / r;
    const double apart = std::clamp(r / (kNearSpacings * p.spacing_m) - 1.0, 0.0, 1.0);
    if (there <= 0.0 || apart <= 0.0)
      continue;
    const double far = apart * static_cast<double>(known.share_beyond(p.position));
    if (far <= 0.0)
      continue;
    const glm::vec3 w(d / r);
    const std::array<float, 9> y = sh::evaluate9(w);
    float cosine = side.visible_cosine(w);
    for (std::size_t i = 0; i < y.size(); ++i)
      cosine -= y[i] * world_transfer[i];
    sum += static_cast<float>(far * there / (std::numbers::pi * r * r)) * cosine * p.power;
  }
  return sum;
}

} // namespace daylit
