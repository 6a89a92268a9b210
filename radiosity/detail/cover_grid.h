#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>

namespace daylit::radiosity {

/// Answers whether a point of a plane is on any of many triangles: a grid of about as many cells as triangles.
class CoverGrid {
public:
  /// Keeps a reference to the triangles.
  explicit CoverGrid(const std::vector<std::array<glm::dvec2, 3>>& triangles);
  bool covers(const glm::dvec2& p) const;

private:
  std::array<int, 2> cell_of(const glm::dvec2& p) const;

  const std::vector<std::array<glm::dvec2, 3>>& triangles_;
  glm::dvec2 low_{0.0}, cells_per_metre_{0.0};
  std::array<int, 2> count_{1, 1};
  std::vector<std::uint32_t> first_, index_; ///< triangles of cell c: index_[first_[c]] .. index_[first_[c + 1] - 1]
};

} // namespace daylit::radiosity
