#include "runtime/trace/visible_surfaces.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include "scene/core/parallel.h"

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

std::vector<std::uint8_t> blocks_with_outlines(const RoomMesh& room, const PinholeCamera& camera,
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

void VisibleSurfaces::set_camera(const PinholeCamera& camera, const glm::dvec3& origin) {
  width_ = camera.width_px;
  height_ = camera.height_px;
  camera_ = camera;
  origin_ = origin;
  rays_ = PixelRays(camera, origin);
  pixel_pitch_ = static_cast<float>(1.0 / std::max(camera.fx, camera.fy));
  object_box_ = {};
  edges_.clear();
  blocks_.resize(static_cast<std::size_t>(block_columns()) * block_rows());
}

void VisibleSurfaces::aim(RayPacket16& rays, int lane, float x, float y) const {
  rays.set(static_cast<std::size_t>(lane), eye(), direction(x, y), static_cast<float>(kNearPlane_m),
           std::numeric_limits<float>::infinity());
}

void VisibleSurfaces::bound_block(int column, int row) {
  const PixelBox pixels =
      PixelBox{column * kBlockSide, row * kBlockSide, (column + 1) * kBlockSide, (row + 1) * kBlockSide}.clipped(
          width_, height_);
  glm::vec3 lo(std::numeric_limits<float>::infinity()), hi = -lo;
  const auto include = [&](int x, int y) {
    const RoomHit hit = room(x, y);
    if (hit.triangle == kNoTriangle)
      return;
    const glm::vec3 p = eye() + hit.depth * direction(static_cast<float>(x), static_cast<float>(y));
    lo = glm::min(lo, p);
    hi = glm::max(hi, p);
  };
  if (is_plain(column, row)) { // convex: its corners bound it
    for (const int y : {pixels.y0, pixels.y1 - 1})
      for (const int x : {pixels.x0, pixels.x1 - 1})
        include(x, y);
  } else
    for (int y = pixels.y0; y < pixels.y1; ++y)
      for (int x = pixels.x0; x < pixels.x1; ++x)
        include(x, y);
  blocks_[block_index(column, row)] =
      lo.x > hi.x ? BlockBound{} : BlockBound{0.5f * (lo + hi), 0.5001f * glm::length(hi - lo)};
}

/// A row of corners, sixteen to a packet.
void VisibleSurfaces::trace_corners(const SeenRoom& room, int row) {
  const int count = block_columns() + 1;
  RayPacket16 rays;
  RayHits16 hits;
  for (int first = 0; first < count; first += kLanes) {
    const int lanes = std::min(kLanes, count - first);
    for (int k = 0; k < kLanes; ++k)
      aim(rays, k, static_cast<float>((first + std::min(k, lanes - 1)) * kBlockSide),
          static_cast<float>(row * kBlockSide));
    room.closest((1u << lanes) - 1u, rays, hits);
    for (int k = 0; k < lanes; ++k)
      corners_[static_cast<std::size_t>(row) * count + first + k] = {hits.triangle[k], hits.distance[k]};
  }
}

/// The block shows one triangle and nothing else.
bool VisibleSurfaces::shows_one_triangle(int column, int row) const {
  const std::uint32_t triangle = corner(column, row).triangle;
  return !crossed_[block_index(column, row)] && corner(column + 1, row).triangle == triangle &&
         corner(column, row + 1).triangle == triangle && corner(column + 1, row + 1).triangle == triangle;
}

VisibleSurfaces::PlaneDepth VisibleSurfaces::plane_depth(const RoomMesh& mesh, std::uint32_t triangle) const {
  const auto& t = mesh.triangles[triangle];
  const glm::vec3 p = mesh.vertices[t[0]];
  const glm::vec3 n = glm::cross(mesh.vertices[t[1]] - p, mesh.vertices[t[2]] - p);
  const float height = glm::dot(n, p - eye());
  return {glm::dot(n, rays_.corner) / height, glm::dot(n, rays_.right) / height, glm::dot(n, rays_.down) / height};
}

void VisibleSurfaces::trace_room_block(const SeenRoom& room, int column, int row) {
  RayPacket16 rays;
  RayHits16 hits;
  const int x0 = column * kBlockSide, y0 = row * kBlockSide;
  for (int k = 0; k < kLanes; ++k)
    aim(rays, k, static_cast<float>(x0 + k % kBlockSide), static_cast<float>(y0 + k / kBlockSide));
  room.closest(0xFFFFu, rays, hits);
  for (int k = 0; k < kLanes; ++k) {
    room_hits_[room_[block_index(column, row)].first_hit + static_cast<std::size_t>(k)] = {hits.triangle[k],
                                                                                           hits.distance[k]};
  }
}

void VisibleSurfaces::trace_room(const SeenRoom& room) {
  crossed_ = blocks_with_outlines(room.mesh, camera_, origin_, kBlockSide);
  corners_.resize(static_cast<std::size_t>(block_columns() + 1) * (block_rows() + 1));
  parallel_for(0, block_rows() + 1, [&](int row) { trace_corners(room, row); });
  room_.assign(blocks_.size(), {});
  std::uint32_t hits = 0;
  for (int row = 0; row < block_rows(); ++row)
    for (int column = 0; column < block_columns(); ++column)
      if (!shows_one_triangle(column, row))
        room_[block_index(column, row)].first_hit = std::exchange(hits, hits + kLanes);
  room_hits_.resize(hits);
  parallel_for(tbb::blocked_range<int>(0, block_rows(), 4), [&](const tbb::blocked_range<int>& rows) {
    for (int row = rows.begin(); row != rows.end(); ++row)
      for (int column = 0; column < block_columns(); ++column) {
        RoomBlock& block = room_[block_index(column, row)];
        if (!is_plain(column, row))
          trace_room_block(room, column, row);
        else if (block.triangle = corner(column, row).triangle; block.triangle != kNoTriangle)
          block.plane = plane_depth(room.mesh, block.triangle);
        bound_block(column, row);
      }
  });
  find_room_edges(room);
}

} // namespace daylit
