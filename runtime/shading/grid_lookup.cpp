// What may be taken from the grid between its points.

#include <algorithm>

#include <glm/geometric.hpp>

#include "runtime/shading/sampling_grid.h"

namespace daylit {

namespace {

constexpr float kSteep = 0.35f; // corners that differ by more are not for what is between: contact shadows
constexpr float kLeastWeight = 0.2f, kWholeWeight = 0.999f; // of the valid corners of a block together

} // namespace

SamplingGrid::Interpolated SamplingGrid::interpolate(Layer layer, int x, int y, const glm::vec3& position,
                                                     const glm::vec3& normal) const {
  Interpolated result;
  if (empty())
    return result;
  const int column = x / kBlockSide, row = y / kBlockSide;
  const float s = static_cast<float>(x % kBlockSide) / kBlockSide, t = static_cast<float>(y % kBlockSide) / kBlockSide;
  const float weight[4] = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
  SkyFractions mixed{Rgb(0.0f), Rgb(0.0f)};
  FractionRange range;
  float sum = 0.0f;
  bool soft = layer == Layer::room, by_another_part = false, hidden = false; // here surfaces may touch
  for (int k = 0; k < 4; ++k) {
    const int u = column + (k & 1), v = row + (k >> 1);
    if (!blocks_.contains(u, v))
      continue;
    const GridPoint& g = at(layer, u, v);
    hidden = hidden || g.surface.hidden;
    if (!is_valid_for(g, layer, position, normal)) {
      by_another_part = by_another_part || g.surface.exists;
      continue;
    }
    if (weight[k] <= 0.0f)
      continue;
    mixed.past_room += weight[k] * g.sky.past_room;
    mixed.past_both += weight[k] * g.sky.past_both;
    sum += weight[k];
    soft = soft && g.is_soft;
    range.include(g.sky.past_both);
  }
  soft = soft && sum >= kLeastWeight;
  if (layer == Layer::room && shows_edge(column, row) && !soft)
    return result; // object and room may touch there
  // The room beside an object: what its hidden corners would say is the shadow where both touch. So does a part of an
  // object beside another.
  result.is_between = sum > kWholeWeight && !hidden;
  const float wanted = layer == Layer::room || by_another_part ? kWholeWeight : kLeastWeight;
  if (!soft && (sum < wanted || hidden || range.width() > kSteep))
    return result;
  result.sky = {mixed.past_room / sum, mixed.past_both / sum};
  result.is_known = true;
  return result;
}

void SamplingGrid::add_hints(Layer layer, int x, int y, const glm::vec3& position, const glm::vec3& normal, int lane,
                             LightHints& hints) const {
  if (empty())
    return;
  std::array<const KnownLights*, 16> neighbours;
  std::size_t count = 0;
  const int column = x / kBlockSide, row = y / kBlockSide;
  if (layer == Layer::object && shows_edge(column, row))
    return; // what stands before a fold does not stand before the next
  for (int v = std::max(row - 1, blocks_.y0); v <= std::min(row + 2, blocks_.y1 - 1); ++v)
    for (int u = std::max(column - 1, blocks_.x0); u <= std::min(column + 2, blocks_.x1 - 1); ++u) {
      const GridPoint& g = at(layer, u, v);
      if (g.evaluated && glm::dot(g.surface.normal, normal) > 0.0f && is_near(g, layer, position, normal))
        neighbours[count++] = sky_words_.data() + index(layer, u, v) * words_for(sky_lights_);
    }
  hints.believe_agreeing(lane, std::span(neighbours).first(count));
}

SamplingGrid::Corners SamplingGrid::plain_corners(int column, int row) const {
  if (empty() || !has_corners(column, row))
    return {};
  Corners corners{};
  FractionRange range;
  bool hidden = false;
  for (int k = 0; k < 4; ++k) {
    const GridPoint& g = at(Layer::room, column + k % 2, row + k / 2);
    if (!g.surface.exists)
      return {};
    corners[static_cast<std::size_t>(k)] = &g;
    range.include(g.sky.past_both);
    hidden = hidden || g.surface.hidden;
  }
  return hidden || range.width() > kSteep ? Corners{} : corners;
}

SamplingGrid::SunCorners SamplingGrid::sun_corners(Layer layer, int column, int row) const {
  if (sun_lights_ == 0 || empty() || !has_corners(column, row))
    return {};
  const PixelSurface& first = at(layer, column, row).surface;
  SunCorners corners;
  const auto add = [&](int x, int y) {
    const std::size_t i = index(layer, x, y);
    if (!points_[i].surface.receives || !is_valid_for(points_[i], layer, first.position, first.normal))
      return false;
    corners.objects[corners.count] = &sun_words_[i * words_for(sun_lights_)];
    corners.room[corners.count++] = &sun_room_words_[i * words_for(sun_lights_)];
    return true;
  };
  for (int k = 0; k < 4; ++k)
    if (!add(column + k % 2, row + k / 2))
      return {};
  for (int y = row - 1; y <= row + 2; ++y)
    for (int x = column - 1; x <= column + 2; ++x) {
      const bool is_corner = x >= column && x <= column + 1 && y >= row && y <= row + 1;
      if (!is_corner && blocks_.contains(x, y))
        add(x, y);
    }
  return corners;
}

} // namespace daylit
