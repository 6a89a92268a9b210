#include "runtime/maps/radiance_map.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "scene/core/parallel.h"

namespace daylit {
namespace {

glm::dvec2 point_of(double column, double row, int side) { return {2.0 * column / side - 1.0, 2.0 * row / side - 1.0}; }

/// Continuous texel position: the first texel spans [0, 1)^2.
glm::dvec2 position(const glm::dvec3& direction, int side) {
  return (octahedral_point(direction) + 1.0) * (0.5 * side);
}

} // namespace

glm::dvec3 RadianceMap::direction(std::size_t texel) const {
  const std::size_t n = static_cast<std::size_t>(side);
  return octahedral_direction(
      point_of(static_cast<double>(texel % n) + 0.5, static_cast<double>(texel / n) + 0.5, side));
}

std::size_t RadianceMap::texel(const glm::dvec3& direction) const {
  const glm::dvec2 p = position(direction, side);
  const int column = std::clamp(static_cast<int>(p.x), 0, side - 1),
            row = std::clamp(static_cast<int>(p.y), 0, side - 1);
  return static_cast<std::size_t>(row) * side + column;
}

/// A side of the square is folded in its middle: what lies beyond it is the square itself, turned by half a turn about
/// that middle.
Rgb RadianceMap::at_folded(int column, int row) const {
  if (column < 0 || column >= side) {
    column = column < 0 ? -1 - column : 2 * side - 1 - column;
    row = side - 1 - row;
  }
  if (row < 0 || row >= side) {
    row = row < 0 ? -1 - row : 2 * side - 1 - row;
    column = side - 1 - column;
  }
  return at(column, row);
}

Rgb RadianceMap::lookup(const glm::vec3& direction) const {
  const glm::vec2 p = glm::vec2(position(direction, side)) - 0.5f;
  const int x = static_cast<int>(std::floor(p.x)), y = static_cast<int>(std::floor(p.y));
  const float s = p.x - static_cast<float>(x), t = p.y - static_cast<float>(y);
  const bool inside = x >= 0 && y >= 0 && x + 1 < side && y + 1 < side;
  const auto texel = [&](int column, int row) { return inside ? at(column, row) : at_folded(column, row); };
  return (1.0f - t) * ((1.0f - s) * texel(x, y) + s * texel(x + 1, y)) +
         t * ((1.0f - s) * texel(x, y + 1) + s * texel(x + 1, y + 1));
}

RadianceMap halved(const RadianceMap& map) {
  RadianceMap half(map.side / 2);
  for (int y = 0; y < half.side; ++y)
    for (int x = 0; x < half.side; ++x)
      half.radiance[static_cast<std::size_t>(y) * half.side + x] =
          0.25f * ((map.at(2 * x, 2 * y) + map.at(2 * x + 1, 2 * y)) +
                   (map.at(2 * x, 2 * y + 1) + map.at(2 * x + 1, 2 * y + 1)));
  return half;
}

Result<void> check_map(const RadianceMap& map, const char* where) {
  if (map.side < 4 || map.side > kMaxMapSide || !std::has_single_bit(static_cast<unsigned>(map.side)))
    return Error{ErrorCode::value_invalid, "a map of side " + std::to_string(map.side), where,
                 "use a power of two from 4 to " + std::to_string(kMaxMapSide)};
  if (map.radiance.size() != static_cast<std::size_t>(map.side) * map.side)
    return Error{ErrorCode::value_invalid, "a map with a wrong number of texels", where, ""};
  for (std::size_t i = 0; i < map.radiance.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (const float v = map.radiance[i][c]; !std::isfinite(v) || v < 0.0f)
        return Error{ErrorCode::value_invalid, "radiance is negative or not finite",
                     std::string(where) + ", texel " + std::to_string(i), "repair what fills the map"};
  return {};
}

RadianceMap sampled_map(int side, int samples, const std::function<Rgb(const glm::dvec3&)>& radiance) {
  RadianceMap map(side);
  parallel_for(0, side, [&](int row) {
    for (int column = 0; column < side; ++column) {
      glm::dvec3 sum(0.0);
      for (int k = 0; k < samples * samples; ++k)
        sum += glm::dvec3(radiance(octahedral_direction(
            point_of(column + (k % samples + 0.5) / samples, row + (k / samples + 0.5) / samples, side))));
      map.radiance[static_cast<std::size_t>(row) * side + column] = Rgb(sum / static_cast<double>(samples * samples));
    }
  });
  return map;
}

} // namespace daylit
