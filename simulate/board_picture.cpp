#include "simulate/board_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>

#include <glm/common.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>

#include "scene/core/parallel.h"

namespace daylit {

namespace {

constexpr int kSamples = 16; ///< per pixel, a lattice: no two of them in one row or column

constexpr std::size_t kLightSteps = 65535;

/// The rays with z = 1 through the corners of all pixels; in between they are interpolated, exact for a pinhole.
struct RayGrid {
  const std::vector<glm::dvec2>& ray;
  int columns;
  const glm::dvec2& at(int x, int y) const {
    return ray[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x)];
  }
};

/// The plane z = 0 of the board: a ray r meets it at (h.x, h.y) / h.z with h = H (r, 1), H the inverse of the matrix of
/// the first two columns and the translation of camera_from_board (a homography). h.z < 0: behind the camera.
glm::dmat3 board_from_ray(const glm::dmat4& camera_from_board) {
  return glm::inverse(
      glm::dmat3(glm::dvec3(camera_from_board[0]), glm::dvec3(camera_from_board[1]), glm::dvec3(camera_from_board[3])));
}

/// Corners of a pixel on the board, in front of the camera; all of them beyond one edge of the paper: it shows wall.
bool shows_wall(const std::array<glm::dvec3, 4>& h, const glm::dvec2& half_paper) {
  for (int axis = 0; axis < 2; ++axis)
    for (const double sign : {-1.0, 1.0})
      if (std::all_of(h.begin(), h.end(), [&](const glm::dvec3& p) { return sign * p[axis] > p.z * half_paper[axis]; }))
        return true;
  return false;
}

double pixel_value(const PrintedBoard& board, const glm::dvec2& half_paper, const RayGrid& rays,
                   const glm::dmat3& to_board, int x, int y) {
  const glm::dvec2 a = rays.at(x, y), b = rays.at(x + 1, y), c = rays.at(x, y + 1), d = rays.at(x + 1, y + 1);
  const auto on_board = [&](const glm::dvec2& ray) { return to_board * glm::dvec3(ray, 1.0); };
  const std::array<glm::dvec3, 4> corners{on_board(a), on_board(b), on_board(c), on_board(d)};
  if (std::all_of(corners.begin(), corners.end(), [](const glm::dvec3& p) { return p.z > 0; }) &&
      shows_wall(corners, half_paper))
    return board.wall;
  double sum = 0;
  for (int k = 0; k < kSamples; ++k) {
    const double u = (k + 0.5) / kSamples, v = (7 * k % kSamples + 0.5) / kSamples;
    const glm::dvec2 ray = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d);
    const glm::dvec3 h = to_board * glm::dvec3(ray, 1.0);
    sum += h.z > 0 ? board.at(h.x / h.z, h.y / h.z) : board.wall;
  }
  return sum / kSamples;
}

void blur_rows(std::vector<double>& value, int width, int height, double sigma) {
  if (!(sigma > 0))
    return;
  const int reach = static_cast<int>(std::ceil(3 * sigma));
  std::vector<double> kernel;
  for (int i = -reach; i <= reach; ++i)
    kernel.push_back(std::exp(-0.5 * i * i / (sigma * sigma)));
  double total = 0;
  for (const double w : kernel)
    total += w;
  parallel_for(0, height, [&](int y) {
    double* row = &value[static_cast<std::size_t>(y) * static_cast<std::size_t>(width)];
    const std::vector<double> before(row, row + width);
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      for (int i = -reach; i <= reach; ++i)
        sum += kernel[static_cast<std::size_t>(i + reach)] *
               before[static_cast<std::size_t>(std::clamp(x + i, 0, width - 1))];
      row[x] = sum / total;
    }
  });
}

std::vector<double> transposed(const std::vector<double>& value, int width, int height) {
  std::vector<double> out(value.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      out[static_cast<std::size_t>(x) * static_cast<std::size_t>(height) + static_cast<std::size_t>(y)] =
          value[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  return out;
}

} // namespace

Result<PrintedBoard> PrintedBoard::print(const BoardLayout& layout, double margin_m) {
  PrintedBoard board{layout, {}, margin_m};
  for (const PlacedMarker& marker : layout.markers) {
    auto print = marker_print(layout.dictionary, marker.id);
    if (!print)
      return print.error();
    board.prints.push_back(std::move(*print));
  }
  return board;
}

glm::dvec2 PrintedBoard::half_paper() const {
  glm::dvec2 half(0.0);
  for (const PlacedMarker& m : layout.markers)
    half = glm::max(half, glm::abs(m.centre_m) + 0.5 * m.side_m + margin_m);
  return half;
}

double PrintedBoard::at(double x, double y) const {
  double value = wall;
  for (std::size_t i = 0; i < prints.size(); ++i) {
    const PlacedMarker& m = layout.markers[i];
    const double dx = x - m.centre_m.x, dy = y - m.centre_m.y, half = 0.5 * m.side_m;
    if (std::abs(dx) >= half + margin_m || std::abs(dy) >= half + margin_m)
      continue;
    value = paper;
    if (std::abs(dx) >= half || std::abs(dy) >= half)
      continue;
    const int cells = prints[i].cells_per_side,
              column = std::min(cells - 1, static_cast<int>((dx / m.side_m + 0.5) * cells)),
              row = std::min(cells - 1, static_cast<int>((0.5 - dy / m.side_m) * cells));
    return prints[i].white[static_cast<std::size_t>(row * cells + column)] ? paper : ink;
  }
  return value;
}

BoardCamera::BoardCamera(const LensModel& lens, const CameraQuality& quality)
    : width_(lens.width_px), height_(lens.height_px), quality_(quality) {
  for (int y = 0; y <= height_; ++y)
    for (int x = 0; x <= width_; ++x) {
      const auto r = lens.unproject({x - 0.5, y - 0.5});
      ray_.push_back(r && r->z > 1e-3 ? glm::dvec2(r->x / r->z, r->y / r->z) : glm::dvec2(NAN));
    }
  for (std::size_t k = 0; k <= kLightSteps; ++k)
    code_.push_back(static_cast<std::uint8_t>(std::lround(255.0f * srgb_encode(static_cast<float>(k) / kLightSteps))));
}

Rgb8Image BoardCamera::developed(const std::vector<double>& light, std::uint32_t seed) const {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Rgb8Image picture{width_, height_, {}};
  picture.bytes.reserve(3 * light.size());
  for (std::size_t i = 0; i < light.size(); ++i) {
    const double v = light[i] * (1 - quality_.uneven * double(i % static_cast<std::size_t>(width_)) / width_);
    const double noisy = v + std::sqrt(quality_.noise.variance(v)) * normal(random);
    const auto step = static_cast<std::size_t>(std::lround(kLightSteps * std::clamp(noisy, 0.0, 1.0)));
    picture.bytes.insert(picture.bytes.end(), 3, code_[step]);
  }
  return picture;
}

Rgb8Image BoardCamera::picture(const PrintedBoard& board, const glm::dmat4& camera_from_board,
                               std::uint32_t seed) const {
  const RayGrid rays{ray_, width_ + 1};
  const glm::dmat3 to_board = board_from_ray(camera_from_board);
  // The front is seen where the board's z axis points towards the camera.
  const bool front = glm::dot(glm::dvec3(camera_from_board[2]), glm::dvec3(camera_from_board[3])) < 0;
  std::vector<double> light(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), board.wall);
  const glm::dvec2 half = board.half_paper();
  if (front)
    parallel_for(0, height_, [&](int y) {
      for (int x = 0; x < width_; ++x)
        light[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)] =
            pixel_value(board, half, rays, to_board, x, y);
    });
  blur_rows(light, width_, height_, quality_.blur_px);
  light = transposed(light, width_, height_);
  blur_rows(light, height_, width_, quality_.blur_px);
  light = transposed(light, height_, width_);
  return developed(light, seed);
}

} // namespace daylit
