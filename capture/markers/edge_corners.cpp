#include <algorithm>
#include <cmath>
#include <optional>

#include <glm/geometric.hpp>

#include "capture/markers/edge_corners.h"

namespace daylit::detail {

namespace {

constexpr int kCellsPerSide = 8;        ///< of the common dictionaries; 6 to 9 occur
constexpr double kCornerFraction = 0.1; ///< of a side, left out at both ends: the neighbouring edge blurs in
constexpr double kProfileStep_px = 0.25;
constexpr double kLeastContrast = 0.01; ///< of 1
constexpr double kLargestMove_px = 3.0;
constexpr double kLeastReach_px = 1.5; ///< of the profile across an edge, to each side

struct Line {
  glm::dvec2 point, direction;
};

/// Where the brightness rises on the way from dark to light, as a fraction of the way: the centroid of its slope. Exact
/// for a straight edge in pixels that integrate over their area. Empty when it does not rise.
std::optional<double> rise(const GreyImage& image, const glm::dvec2& from, const glm::dvec2& to) {
  const int steps = std::max(4, static_cast<int>(glm::length(to - from) / kProfileStep_px));
  double moment = 0, before = image.at(from);
  const double dark = before;
  for (int i = 1; i <= steps; ++i) {
    const double here = image.at(from + (to - from) * (double(i) / steps));
    moment += (here - before) * (i - 0.5) / steps;
    before = here;
  }
  const double contrast = before - dark;
  if (!(contrast > kLeastContrast))
    return std::nullopt;
  const double fraction = moment / contrast;
  return fraction > 0 && fraction < 1 ? std::optional(fraction) : std::nullopt;
}

Line fit(const std::vector<glm::dvec2>& points) {
  glm::dvec2 mean(0.0);
  for (const glm::dvec2& p : points)
    mean += p / static_cast<double>(points.size());
  double xx = 0, xy = 0, yy = 0;
  for (const glm::dvec2& p : points) {
    const glm::dvec2 d = p - mean;
    xx += d.x * d.x, xy += d.x * d.y, yy += d.y * d.y;
  }
  const double angle = 0.5 * std::atan2(2 * xy, xx - yy);
  return {mean, {std::cos(angle), std::sin(angle)}};
}

double distance(const Line& line, const glm::dvec2& p) {
  const glm::dvec2 d = p - line.point;
  return std::abs(d.x * line.direction.y - d.y * line.direction.x);
}

/// The side between two corners; `outward` is the unit normal away from the square, `depth` the square's extent along
/// it.
std::optional<Line> fit_side(const GreyImage& image, const glm::dvec2& a, const glm::dvec2& b,
                             const glm::dvec2& outward, double depth) {
  // The profile ends in the outermost cell, which is `depth` / kCellsPerSide wide, but covers the blur of the edge.
  const double length = glm::length(b - a), extent = std::clamp(0.6 * depth / kCellsPerSide, kLeastReach_px, 5.0);
  const int samples = std::clamp(static_cast<int>(length), 12, 96);
  std::vector<glm::dvec2> points;
  for (int i = 0; i < samples; ++i) {
    const glm::dvec2 middle = a + (b - a) * (kCornerFraction + (1 - 2 * kCornerFraction) * (i + 0.5) / samples);
    if (const auto fraction = rise(image, middle - extent * outward, middle + extent * outward))
      points.push_back(middle + (2 * *fraction - 1) * extent * outward);
  }
  if (points.size() < static_cast<std::size_t>(samples) / 2)
    return std::nullopt;
  const Line first = fit(points);
  std::vector<double> away;
  for (const glm::dvec2& p : points)
    away.push_back(distance(first, p));
  std::vector<double> sorted = away;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  const double limit = 3 * sorted[sorted.size() / 2] + 1e-3;
  std::vector<glm::dvec2> kept;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (away[i] <= limit)
      kept.push_back(points[i]);
  return fit(kept);
}

std::optional<glm::dvec2> crossing(const Line& a, const Line& b) {
  const double det = a.direction.x * b.direction.y - a.direction.y * b.direction.x;
  if (std::abs(det) < 0.05)
    return std::nullopt;
  const glm::dvec2 d = b.point - a.point;
  return a.point + a.direction * ((d.x * b.direction.y - d.y * b.direction.x) / det);
}

} // namespace

double GreyImage::at(const glm::dvec2& p) const {
  const double x = std::clamp(p.x, 0.0, width - 1.0), y = std::clamp(p.y, 0.0, height - 1.0);
  const int x0 = std::min(static_cast<int>(x), std::max(0, width - 2)),
            y0 = std::min(static_cast<int>(y), std::max(0, height - 2));
  const int x1 = std::min(x0 + 1, width - 1), y1 = std::min(y0 + 1, height - 1);
  const double u = x - x0, v = y - y0;
  const auto texel = [&](int i, int j) {
    return double(value[static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i)]);
  };
  return (1 - v) * ((1 - u) * texel(x0, y0) + u * texel(x1, y0)) + v * ((1 - u) * texel(x0, y1) + u * texel(x1, y1));
}

int fit_square_edges(const GreyImage& image, std::array<glm::dvec2, 4>& corner_px) {
  int moved = 0;
  const std::array<glm::dvec2, 4> start = corner_px;
  for (int pass = 0; pass < 2; ++pass) {
    const glm::dvec2 centre = 0.25 * (corner_px[0] + corner_px[1] + corner_px[2] + corner_px[3]);
    std::array<std::optional<Line>, 4> side;
    moved = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const glm::dvec2 a = corner_px[i], b = corner_px[(i + 1) % 4], along = glm::normalize(b - a);
      glm::dvec2 outward(along.y, -along.x);
      if (glm::dot(outward, 0.5 * (a + b) - centre) < 0)
        outward = -outward;
      const double depth = 2 * glm::dot(outward, 0.5 * (a + b) - centre);
      side[i] = fit_side(image, a, b, outward, depth);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      const auto& before = side[(i + 3) % 4];
      const auto p = before && side[i] ? crossing(*before, *side[i]) : std::nullopt;
      if (p && glm::length(*p - start[i]) < kLargestMove_px)
        corner_px[i] = *p, ++moved;
    }
  }
  return moved;
}

GreyImage linear_grey(const Rgb8Image& picture, double exponent) {
  std::array<float, 256> light;
  for (std::size_t code = 0; code < light.size(); ++code)
    light[code] = static_cast<float>(std::pow(double(code) / 255, exponent));
  GreyImage image{picture.width, picture.height, std::vector<float>(picture.bytes.size() / 3)};
  for (std::size_t i = 0; i < image.value.size(); ++i)
    image.value[i] =
        (light[picture.bytes[3 * i]] + light[picture.bytes[3 * i + 1]] + light[picture.bytes[3 * i + 2]]) / 3;
  return image;
}

} // namespace daylit::detail
