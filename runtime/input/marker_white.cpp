#include <algorithm>
#include <cmath>

#include "runtime/input/photograph.h"

namespace daylit {

namespace {

constexpr int kSamplesPerSide = 48;
/// Ring around the marker, in half sides: past the blur of the edge, inside a white margin of one cell in eight.
constexpr double kRingInner = 1.08, kRingOuter = 1.2;
/// The black frame of the square itself, one cell wide, without its blurred edges.
constexpr double kFrameInner = 0.84, kFrameOuter = 0.92;

/// Plane-to-picture mapping of the square (-1..1)^2, top left first as in SeenMarker (Heckbert 1989).
struct SquareMapping {
  explicit SquareMapping(const std::array<glm::dvec2, 4>& q) : q0(q[0]) {
    const glm::dvec2 d1 = q[1] - q[2], d2 = q[3] - q[2], s = q[0] - q[1] + q[2] - q[3];
    const double det = d1.x * d2.y - d2.x * d1.y;
    g = (s.x * d2.y - d2.x * s.y) / det;
    h = (d1.x * s.y - s.x * d1.y) / det;
    du = q[1] - q[0] + g * q[1];
    dv = q[3] - q[0] + h * q[3];
  }
  glm::dvec2 at(double x, double y) const { // x right, y down in the print, -1..1
    const double u = 0.5 * (x + 1), v = 0.5 * (y + 1);
    return (q0 + u * du + v * dv) / (1 + g * u + h * v);
  }
  glm::dvec2 q0, du, dv;
  double g, h;
};

struct Ring {
  std::array<std::vector<float>, 3> values;
  std::size_t outside = 0, saturated = 0, samples = 0;
};

Ring sample_ring(const Photograph& photo, const SquareMapping& map, double inner, double outer) {
  Ring ring;
  const PhotoPixels pixels = photo.pixels();
  for (int side = 0; side < 4; ++side)
    for (int i = 0; i < kSamplesPerSide; ++i)
      for (int layer = 0; layer < 4; ++layer) {
        const double r = inner + (outer - inner) * (layer + 0.5) / 4, t = r * (2 * (i + 0.5) / kSamplesPerSide - 1);
        const glm::dvec2 p = side == 0   ? map.at(t, -r)
                             : side == 1 ? map.at(r, t)
                             : side == 2 ? map.at(t, r)
                                         : map.at(-r, t);
        ++ring.samples;
        const int x = static_cast<int>(std::lround(p.x)), y = static_cast<int>(std::lround(p.y));
        if (!(x >= 0 && y >= 0 && x < pixels.width() && y < pixels.height())) {
          ++ring.outside;
          continue;
        }
        const std::size_t pixel = pixels.index(x, y);
        ring.saturated += photo.is_saturated(pixel) ? 1 : 0;
        for (int c = 0; c < 3; ++c)
          ring.values[static_cast<std::size_t>(c)].push_back(pixels[pixel][c]);
      }
  return ring;
}

Rgb median(Ring& ring) {
  Rgb out(0.0f);
  for (int c = 0; c < 3; ++c) {
    auto& v = ring.values[static_cast<std::size_t>(c)];
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
    out[c] = v[v.size() / 2];
  }
  return out;
}

} // namespace

Result<Rgb> marker_white(const Photograph& photo, const std::array<glm::dvec2, 4>& corner_px) {
  const auto bad = [](const std::string& what, const std::string& hint) {
    return Error{ErrorCode::value_invalid, what, "white around the marker", hint};
  };
  for (const glm::dvec2& p : corner_px)
    if (!(std::abs(p.x) < 1e6 && std::abs(p.y) < 1e6))
      return bad("the marker's corners are not in the picture", "");
  const SquareMapping map(corner_px);
  Ring paper = sample_ring(photo, map, kRingInner, kRingOuter),
       black = sample_ring(photo, map, kFrameInner, kFrameOuter);
  if (2 * paper.outside > paper.samples || black.values[0].empty())
    return bad("more than half of it lies outside the picture", "move the marker into the picture");
  if (2 * paper.saturated > paper.samples)
    return bad("it is saturated in the picture", "expose shorter, or give scale as a number");
  const Rgb white = median(paper), dark = median(black);
  if (!(luminance(white) > 2 * luminance(dark)))
    return bad("it is not clearly brighter than the black of the marker",
               "leave a white margin of an eighth of the marker's side around it, or give scale as a number");
  return white;
}

} // namespace daylit
