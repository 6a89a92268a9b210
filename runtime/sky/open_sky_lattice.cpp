#include "runtime/sky/open_sky_lattice.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/core/parallel.h"

namespace daylit::open_sky {

namespace {

constexpr float kCellFraction = 0.5f;      // of a cell's side: the widest box
constexpr float kDistanceFraction = 0.25f; // of the distance to a window: the same
constexpr double kPointsPerCorner = 4.0;   // with fewer, looking up each point is cheaper

} // namespace

/// SkyMap::interpolate() in single precision.
Rgb interpolate(const SkyMap& map, float u, float v) {
  const float fu = std::floor(u), fv = std::floor(v), s = u - fu, t = v - fv;
  int x0 = static_cast<int>(fu), x1 = x0 + 1;
  x0 = x0 < 0 ? x0 + map.width : x0;
  x1 = x1 >= map.width ? x1 - map.width : x1;
  const int y0 = std::clamp(static_cast<int>(fv), 0, map.height - 1),
            y1 = std::clamp(static_cast<int>(fv) + 1, 0, map.height - 1);
  return (1.0f - t) * ((1.0f - s) * map.at(x0, y0) + s * map.at(x1, y0)) +
         t * ((1.0f - s) * map.at(x0, y1) + s * map.at(x1, y1));
}

/// Spacing: half a cell's side, and a quarter of the distance to the nearest cell; whatever is less.
std::optional<Lattice> Lattice::around(std::span<const glm::vec3> points, std::span<const SkyMap> pyramid,
                                       std::span<const ApertureCell> cells, const glm::dvec3& origin) {
  glm::vec3 low = points[0], high = low;
  for (const glm::vec3& p : points) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  Lattice lattice;
  lattice.low_ = low;
  lattice.spacing_ = std::numeric_limits<float>::infinity();
  for (const ApertureCell& cell : cells) {
    const glm::vec3 c(cell.centre - origin);
    const float distance = glm::length(c - glm::clamp(c, low, high));
    if (distance * distance < static_cast<float>(close2(cell)))
      return std::nullopt;
    lattice.spacing_ = std::min(
        {lattice.spacing_, kCellFraction * std::sqrt(static_cast<float>(cell.area_m2)), kDistanceFraction * distance});
  }
  double corners = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double along = std::max(std::ceil(static_cast<double>((high[axis] - low[axis]) / lattice.spacing_)), 1.0);
    corners *= along + 1.0;
    if (!(corners * kPointsPerCorner <= static_cast<double>(points.size())))
      return std::nullopt;
    lattice.boxes_[axis] = static_cast<int>(along);
  }
  lattice.look_up(pyramid, cells, origin);
  return lattice;
}

glm::vec3 Lattice::corner_position(int corner) const {
  const int nx = boxes_.x + 1, ny = boxes_.y + 1;
  return low_ + spacing_ * glm::vec3(corner % nx, corner / nx % ny, corner / (nx * ny));
}

int Lattice::box_of(const glm::vec3& point) const {
  const glm::ivec3 i = glm::clamp(glm::ivec3((point - low_) / spacing_), glm::ivec3(0), boxes_ - 1);
  return (i.z * boxes_.y + i.y) * boxes_.x + i.x;
}

glm::vec3 Lattice::in_box(int box, const glm::vec3& point) const {
  return (point - (low_ + spacing_ * glm::vec3(box_index(box)))) / spacing_;
}

/// tau L of every cell, as the corners see it.
void Lattice::look_up(std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells, const glm::dvec3& origin) {
  const int corners = corner_count();
  radiance_.resize(cells.size() * static_cast<std::size_t>(corners));
  parallel_for(tbb::blocked_range<std::size_t>(0, cells.size(), 8), [&](const auto& range) {
    Receivers r;
    CellView view;
    for (int first = 0; first < corners; first += kLanes) {
      const int count = std::min(kLanes, corners - first);
      for (int k = 0; k < kLanes; ++k)
        r.set(k, corner_position(first + std::min(k, count - 1)), glm::vec3(0.0f));
      for (std::size_t c = range.begin(); c != range.end(); ++c) {
        const SkyMap& map = pyramid[cells[c].level];
        view_cell(CellConstants(cells[c], map, origin), r, view);
        Rgb* to = &radiance_[c * static_cast<std::size_t>(corners) + static_cast<std::size_t>(first)];
        for (int k = 0; k < count; ++k)
          to[k] = cells[c].transmittance * interpolate(map, view.u[k], view.v[k]);
      }
    }
  });
}

/// Trilinear interpolation as a polynomial: f = sum over m of a_m x^(m&1) y^(m>>1&1) z^(m>>2), whose a_m are the mixed
/// differences of the corner values.
void Lattice::box_radiance(int box, std::vector<BoxRadiance>& radiance) const {
  const glm::ivec3 low = box_index(box), side = boxes_ + 1;
  const std::size_t corners = static_cast<std::size_t>(corner_count());
  radiance.resize(radiance_.size() / corners);
  for (std::size_t cell = 0; cell < radiance.size(); ++cell) {
    Rgb value[8];
    for (int m = 0; m < 8; ++m) {
      const glm::ivec3 i = low + glm::ivec3(m & 1, m >> 1 & 1, m >> 2);
      value[m] = radiance_[cell * corners + static_cast<std::size_t>((i.z * side.y + i.y) * side.x + i.x)];
    }
    for (int step = 1; step < 8; step *= 2) // differences along x, then y, then z
      for (int m = 0; m < 8; ++m)
        if (m & step)
          value[m] -= value[m - step];
    for (int m = 0; m < 8; ++m)
      for (int c = 0; c < 3; ++c)
        radiance[cell].factor[c][m] = value[m][c];
  }
}

} // namespace daylit::open_sky
