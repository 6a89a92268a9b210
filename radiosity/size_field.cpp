#include "radiosity/size_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <glm/geometric.hpp>

#include "radiosity/detail/sampling.h"
#include "scene/core/parallel.h"

namespace daylit::radiosity {

namespace {

constexpr std::uint32_t kWalks = 32768;
constexpr int kBounces = 8;
constexpr double kFaintest = 1e-3; // of a walk's weight: it ends there
constexpr double kCells = 64;      // along the room's longest side
constexpr double kUsual = 0.1;     // of the usual importance: from here on facets keep their size

struct Landing {
  glm::dvec3 point;
  double weight;
};

/// One walk: uniform from the receiver, cosine-distributed from each surface, weight times its reflectance.
std::vector<Landing> walk(const Room& room, const RayScene& rays, const glm::dvec3& from, std::uint32_t index) {
  std::vector<Landing> landings;
  glm::dvec3 p = from, d = sphere_direction(r2_point(index, glm::dvec2(0.0)));
  double weight = 1;
  for (int bounce = 0; bounce < kBounces && weight > kFaintest; ++bounce) {
    RayHit hit;
    if (!rays.closest(rays.to_local(p), glm::vec3(d), rays.surface_offset(), std::numeric_limits<float>::infinity(),
                      hit))
      break;
    p += static_cast<double>(hit.distance) * d;
    landings.push_back({p, weight});
    const RoomTriangle& t = room.triangles[hit.triangle];
    const glm::dvec3 normal =
        glm::normalize(glm::cross(room.corner(t, 1) - room.corner(t, 0), room.corner(t, 2) - room.corner(t, 0)));
    const Rgb& reflectance = room.materials[t.material].reflectance;
    weight *= static_cast<double>(reflectance.r + reflectance.g + reflectance.b) / 3.0;
    const glm::dvec3 side = glm::dot(normal, d) < 0.0 ? normal : -normal;
    d = cosine_direction(side, r2_point(index, random_shift(mix_bits(index) + static_cast<std::uint64_t>(bounce))));
  }
  return landings;
}

} // namespace

/// W of a cell: the weight that lands in it. Its usual value: the mean over what lands.
SizeField::SizeField(const Room& room, const RayScene& rays, std::span<const glm::dvec3> receivers) {
  if (receivers.empty())
    return;
  const Bounds bounds = room.bounds();
  const glm::dvec3 size = bounds.size();
  low_ = bounds.min;
  cell_m_ = std::max({size.x, size.y, size.z}) / kCells;
  cells_ = glm::ivec3(size / cell_m_) + 1;
  importance_.resize(static_cast<std::size_t>(cells_.x) * static_cast<std::size_t>(cells_.y) *
                     static_cast<std::size_t>(cells_.z));
  std::vector<std::vector<Landing>> walks(kWalks);
  parallel_for(std::uint32_t{0}, kWalks,
               [&](std::uint32_t i) { walks[i] = walk(room, rays, receivers[i % receivers.size()], i); });
  for (const std::vector<Landing>& landings : walks)
    for (const Landing& l : landings)
      importance_[cell_of(l.point)] += l.weight;
  double sum = 0, sum2 = 0;
  for (const std::vector<Landing>& landings : walks)
    for (const Landing& l : landings) {
      sum += l.weight;
      sum2 += l.weight * importance_[cell_of(l.point)];
    }
  for (double& weight : importance_)
    weight *= sum / (kUsual * sum2);
}

double SizeField::at(const glm::dvec3& p) const {
  const double w = importance(p);
  return w > 0 ? std::clamp(std::pow(w, -0.25), 1.0, kCoarsest) : kCoarsest;
}

double SizeField::importance(const glm::dvec3& p) const {
  if (importance_.empty())
    return 1.0;
  return importance_[cell_of(p)];
}

std::size_t SizeField::cell_of(const glm::dvec3& p) const {
  std::size_t cell = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double along = std::clamp((p[axis] - low_[axis]) / cell_m_, 0.0, static_cast<double>(cells_[axis] - 1));
    cell = cell * static_cast<std::size_t>(cells_[axis]) + static_cast<std::size_t>(along);
  }
  return cell;
}

} // namespace daylit::radiosity
