#include "radiosity/detail/air_height.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace daylit::radiosity {

namespace {

constexpr double kOff = 0.25;      // of the least height: so far from a surface is the air looked at
constexpr double kShortest = 0.25; // of the longest edge

} // namespace

Result<AirHeight> AirHeight::make(const Room& room, const SizeField& field, double least_m) {
  auto rays = RayScene::build(room);
  if (!rays)
    return rays.error();
  return AirHeight(std::move(*rays), field, least_m);
}

/// Up and down to the next surfaces; infinite where one is farther than `within_m`.
double AirHeight::height_m(const glm::dvec3& p, double within_m) const {
  double height = 0.0;
  for (const float up : {1.0f, -1.0f}) {
    RayHit hit;
    if (!rays_.closest(rays_.to_local(p), {0.0f, 0.0f, up}, 0.0f, static_cast<float>(within_m), hit))
      return std::numeric_limits<double>::infinity();
    height += static_cast<double>(hit.distance);
  }
  return height;
}

double AirHeight::edge_m(const glm::dvec3& p, const glm::dvec3& normal, double longest_m) const {
  double edge = longest_m;
  for (const glm::dvec3& side : {normal, -normal}) {
    if (!field_->reaches(p, side))
      continue;
    const double height = height_m(p + kOff * least_m_ * side, longest_m);
    if (height >= least_m_)
      edge = std::min(edge, std::max(height, kShortest * longest_m));
  }
  return edge;
}

} // namespace daylit::radiosity
