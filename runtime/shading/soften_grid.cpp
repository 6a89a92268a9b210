// Shadows of few lights, far behind what casts them: silhouettes that fall apart are joined.
//
// The shadows of two lights at an angle a lie d a apart on a surface d behind the object. There a shadow that changes
// within less is an error of the samples, and the mean over that width takes it out (axis-aligned filtering, Mehta et
// al. 2012; by the lights' own distances instead of the source's size, so that a bright cloud stays sharp).

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/shading/sampling_grid.h"
#include "scene/core/parallel.h"

namespace daylit {

namespace {
constexpr float kSpacings = 1.5f;   // reach of the mean, in distances between the shadows of two lights
constexpr int kMostSteps = 24;      // grid points to each side
constexpr float kSoftWeight = 2.0f; // of the points meant together, its own counts 1: from here on the mean decides
} // namespace

/// Over the points of a row or column within `reach` that lie on the same plane, with weight 1 - distance / reach.
SamplingGrid::Mean SamplingGrid::mean_along(const glm::ivec2& step, std::span<const Rgb> values, float reach,
                                            int column, int row) const {
  const PixelSurface& here = at(Layer::room, column, row).surface;
  Mean mean{values[block_index(column, row)], 1.0f};
  for (const int side : {-1, 1})
    for (int k = 1; k <= kMostSteps; ++k) {
      const int u = column + side * k * step.x, v = row + side * k * step.y;
      if (!blocks_.contains(u, v))
        break;
      const GridPoint& there = at(Layer::room, u, v);
      if (!is_valid_for(there, Layer::room, here.position, here.normal))
        continue;
      const float weight = 1.0f - glm::distance(there.surface.position, here.position) / reach;
      if (weight <= 0.0f)
        break;
      mean.value += weight * values[block_index(u, v)];
      mean.weight += weight;
    }
  mean.value /= mean.weight;
  return mean;
}

/// One pass along the rows, one along the columns, of the part that the objects take of what comes past the room:
/// beside a shadow of the room no point loses more than it has.
void SamplingGrid::soften(const SampledPicture& picture) {
  const std::size_t count = points_.size() / 2;
  std::vector<Rgb> lost(count, Rgb(0.0f)), across(count, Rgb(0.0f));
  std::vector<float> reach(count, 0.0f);
  const auto for_points = [&](const auto& work) {
    parallel_for(tbb::blocked_range<int>(blocks_.y0, blocks_.y1, 4), [&](const tbb::blocked_range<int>& range) {
      for (int row = range.begin(); row != range.end(); ++row)
        for (int column = blocks_.x0; column < blocks_.x1; ++column)
          work(column, row, block_index(column, row));
    });
  };
  for_points([&](int column, int row, std::size_t i) {
    const GridPoint& g = at(Layer::room, column, row);
    if (!g.surface.receives)
      return;
    const glm::vec3& x = g.surface.position;
    for (int c = 0; c < 3; ++c)
      if (g.sky.past_room[c] > 0.0f)
        lost[i][c] = 1.0f - g.sky.past_both[c] / g.sky.past_room[c];
    reach[i] = kSpacings * picture.light_spacing * glm::distance(x, glm::clamp(x, picture.low, picture.high));
  });
  for_points([&](int column, int row, std::size_t i) {
    if (reach[i] > 0.0f)
      across[i] = mean_along({1, 0}, lost, reach[i], column, row).value;
  });
  for_points([&](int column, int row, std::size_t i) {
    if (reach[i] <= 0.0f)
      return;
    GridPoint& g = points_[index(Layer::room, column, row)];
    const Mean mean = mean_along({0, 1}, across, reach[i], column, row);
    g.sky.past_both = g.sky.past_room * (1.0f - mean.value);
    g.is_soft = mean.weight >= kSoftWeight;
  });
}

} // namespace daylit
