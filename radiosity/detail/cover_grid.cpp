#include "radiosity/detail/cover_grid.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>

namespace daylit::radiosity {

namespace {

constexpr double kSlack = 1e-9; // of the doubled areas, and of the plane's size
constexpr std::size_t kEntriesPerTriangle = 32;

double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

/// On or in the triangle. A point on the seam of two triangles must be in one of them whatever the rounding.
bool inside(const std::array<glm::dvec2, 3>& t, const glm::dvec2& p) {
  const double s0 = cross(t[1] - t[0], p - t[0]), s1 = cross(t[2] - t[1], p - t[1]), s2 = cross(t[0] - t[2], p - t[2]);
  const double slack = kSlack * (std::abs(s0) + std::abs(s1) + std::abs(s2));
  return (s0 >= -slack && s1 >= -slack && s2 >= -slack) || (s0 <= slack && s1 <= slack && s2 <= slack);
}

} // namespace

/// A grid of cells with the triangles that touch each, as one list with offsets; about one triangle per cell.
CoverGrid::CoverGrid(const std::vector<std::array<glm::dvec2, 3>>& triangles) : triangles_(triangles) {
  glm::dvec2 high(0.0);
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (const glm::dvec2& p : triangles[i]) {
      low_ = i == 0 ? p : glm::min(low_, p);
      high = i == 0 ? p : glm::max(high, p);
    }
  const glm::dvec2 size = high - low_;
  const auto each_cell = [&](const std::array<glm::dvec2, 3>& t, const auto& visit) {
    const glm::dvec2 pad = kSlack * size;
    const auto lo = cell_of(glm::min(t[0], glm::min(t[1], t[2])) - pad);
    const auto hi = cell_of(glm::max(t[0], glm::max(t[1], t[2])) + pad);
    for (int y = lo[1]; y <= hi[1]; ++y)
      for (int x = lo[0]; x <= hi[0]; ++x)
        visit(static_cast<std::size_t>(y) * count_[0] + x);
  };
  // Coarser while large triangles are listed in too many cells.
  for (int across = std::clamp(static_cast<int>(std::sqrt(static_cast<double>(triangles.size()))), 1, 1024);;
       across /= 2) {
    for (int axis = 0; axis < 2; ++axis) {
      count_[axis] = across;
      cells_per_metre_[axis] = size[axis] > 0.0 ? across / size[axis] : 0.0;
    }
    first_.assign(static_cast<std::size_t>(across) * across + 1, 0);
    std::size_t entries = 0;
    for (const auto& t : triangles)
      if (entries <= kEntriesPerTriangle * triangles.size())
        each_cell(t, [&](std::size_t c) {
          ++first_[c + 1];
          ++entries;
        });
    if (across == 1 || entries <= kEntriesPerTriangle * triangles.size())
      break;
  }
  for (std::size_t c = 1; c < first_.size(); ++c)
    first_[c] += first_[c - 1];
  index_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t i = 0; i < triangles.size(); ++i)
    each_cell(triangles[i], [&](std::size_t c) { index_[next[c]++] = i; });
}

std::array<int, 2> CoverGrid::cell_of(const glm::dvec2& p) const {
  std::array<int, 2> cell{};
  for (int axis = 0; axis < 2; ++axis) {
    const double x = (p[axis] - low_[axis]) * cells_per_metre_[axis];
    cell[axis] = static_cast<int>(std::clamp(x, 0.0, count_[axis] - 1.0));
  }
  return cell;
}

bool CoverGrid::covers(const glm::dvec2& p) const {
  const auto cell = cell_of(p);
  const std::size_t c = static_cast<std::size_t>(cell[1]) * count_[0] + cell[0];
  return std::any_of(index_.begin() + first_[c], index_.begin() + first_[c + 1],
                     [&](std::uint32_t i) { return inside(triangles_[i], p); });
}

} // namespace daylit::radiosity
