#include "simulate/marker_board.h"

#include <cmath>

#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

namespace daylit {

const std::array<std::uint8_t, 6> kMarker23 = {0b100110, 0b100101, 0b001111, 0b011001, 0b110011, 0b110011};

namespace {
constexpr int kCells = 8; // six and the border
}

MarkerBoard MarkerBoard::printed(const MarkerConfig& marker) {
  MarkerBoard board;
  board.world_from_board = marker.world_from_board;
  board.marker_size_m = marker.size_m;
  board.margin_m = 0.25 * marker.size_m;
  board.white_reflectance = static_cast<float>(marker.white_reflectance);
  return board;
}

std::array<glm::dvec3, 4> MarkerBoard::corners() const {
  const double h = half_side_m();
  const auto world = [this](double x, double y) { return glm::dvec3(world_from_board * glm::dvec4(x, y, 0.0, 1.0)); };
  return {world(-h, -h), world(h, -h), world(h, h), world(-h, h)};
}

Rgb MarkerBoard::reflectance(const glm::dvec3& world_point) const {
  const glm::dvec3 d = world_point - glm::dvec3(world_from_board[3]);
  const double x = glm::dot(d, glm::dvec3(world_from_board[0])), y = glm::dot(d, glm::dvec3(world_from_board[1]));
  const int column = static_cast<int>(std::floor((x / marker_size_m + 0.5) * kCells));
  const int row = static_cast<int>(std::floor((0.5 - y / marker_size_m) * kCells));
  if (column < 0 || row < 0 || column >= kCells || row >= kCells)
    return Rgb(white_reflectance);
  const bool inside = column > 0 && row > 0 && column < kCells - 1 && row < kCells - 1;
  const bool white = inside && ((kMarker23[static_cast<std::size_t>(row - 1)] >> (kCells - 2 - column)) & 1) != 0;
  return Rgb(white ? white_reflectance : black_reflectance);
}

} // namespace daylit
