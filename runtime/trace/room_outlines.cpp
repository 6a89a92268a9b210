#include "runtime/trace/room_outlines.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>

namespace daylit {

namespace {

constexpr std::size_t kMostTriangles = 20000; // more cover the picture with edges
constexpr double kMargin_px = 0.75;           // half a pixel for coverage samples, the rest for rounding

/// Marks the blocks that a segment of the picture may touch.
class BlockMarker {
public:
  BlockMarker(int columns, int rows, int side)
      : columns_(columns), rows_(rows), side_(side), marked_(static_cast<std::size_t>(columns) * rows, 0) {}
  void mark(glm::dvec2 a, glm::dvec2 b) {
    if (a.y > b.y)
      std::swap(a, b);
    const int first = block_of(a.y - kMargin_px) - 1, last = block_of(b.y + kMargin_px);
    for (int row = std::max(first, 0); row <= std::min(last, rows_ - 1); ++row) {
      // The square of a block reaches to the first pixel of the next one.
      const double top = row * side_ - kMargin_px, bottom = (row + 1) * side_ + kMargin_px;
      const double height = b.y - a.y;
      const auto at = [&](double y) {
        return height > 0.0 ? a.x + (b.x - a.x) * std::clamp((y - a.y) / height, 0.0, 1.0) : a.x;
      };
      double low = std::min(at(top), at(bottom)), high = std::max(at(top), at(bottom));
      if (!(height > 0.0)) {
        low = std::min(a.x, b.x);
        high = std::max(a.x, b.x);
      }
      const int from = std::max(block_of(low - kMargin_px) - 1, 0),
                to = std::min(block_of(high + kMargin_px), columns_ - 1);
      for (int column = from; column <= to; ++column)
        marked_[static_cast<std::size_t>(row) * columns_ + column] = 1;
    }
  }
  std::vector<std::uint8_t> take() { return std::move(marked_); }

private:
  int block_of(double pixel) const { return static_cast<int>(std::floor(std::clamp(pixel, -1e6, 1e6) / side_)); }
  int columns_, rows_, side_;
  std::vector<std::uint8_t> marked_;
};

} // namespace

std::vector<std::uint8_t> blocks_with_outlines(const RoomMesh& room, const RenderCamera& camera,
                                               const glm::dvec3& origin, int side) {
  const int columns = (camera.width_px + side - 1) / side, rows = (camera.height_px + side - 1) / side;
  if (room.triangles.size() > kMostTriangles)
    return std::vector<std::uint8_t>(static_cast<std::size_t>(columns) * rows, 1);
  BlockMarker marker(columns, rows, side);
  const glm::dmat3 axes(camera.world_from_camera);
  const glm::dvec3 eye = camera.eye() - origin;
  std::vector<glm::dvec3> seen; // in the camera's frame
  for (const glm::vec3& v : room.vertices)
    seen.push_back((glm::dvec3(v) - eye) * axes); // transpose of a rotation
  const double near = 0.5 * kNearPlane_m;
  const auto pixel = [&](const glm::dvec3& p) {
    return glm::dvec2(camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy);
  };
  for (const auto& t : room.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      glm::dvec3 a = seen[t[k]], b = seen[t[(k + 1) % 3]];
      if (a.z < near && b.z < near)
        continue;
      if (a.z < near)
        a = glm::mix(b, a, (b.z - near) / (b.z - a.z));
      else if (b.z < near)
        b = glm::mix(a, b, (a.z - near) / (a.z - b.z));
      marker.mark(pixel(a), pixel(b));
    }
  return marker.take();
}

} // namespace daylit
