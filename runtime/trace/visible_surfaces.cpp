#include "runtime/trace/visible_surfaces.h"

#include <algorithm>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/core/parallel.h"

namespace daylit {

void VisibleSurfaces::set_camera(const RenderCamera& camera, const glm::dvec3& origin) {
  const bool same_size = camera.width_px == width_ && camera.height_px == height_;
  if (same_size)
    clear_objects();
  width_ = camera.width_px;
  height_ = camera.height_px;
  camera_ = camera;
  origin_ = origin;
  rays_ = PixelRays(camera, origin);
  pixel_pitch_ = static_cast<float>(1.0 / std::max(camera.fx, camera.fy));
  const std::size_t pixels = static_cast<std::size_t>(width_) * height_;
  room_.resize(pixels);
  if (!same_size) {
    object_.assign(pixels, {});
    edge_of_pixel_.assign(pixels, kNoEdge);
    edges_.clear();
  }
  object_box_ = {};
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
    const RoomHit& hit = room_[pixel_index(x, y)];
    if (hit.triangle == kNoTriangle)
      return;
    const glm::vec3 p = eye() + hit.depth * direction(static_cast<float>(x), static_cast<float>(y));
    lo = glm::min(lo, p);
    hi = glm::max(hi, p);
  };
  if (plain_[block_index(column, row)]) { // convex: its corners bound it
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
void VisibleSurfaces::trace_corners(const PacketScene& room, int row) {
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

/// Depths from the plane of the one triangle that the block shows; false when it may show more.
bool VisibleSurfaces::fill_plain_block(const RoomMesh& mesh, int column, int row) {
  const std::size_t stride = static_cast<std::size_t>(block_columns()) + 1, i = row * stride + column;
  const std::uint32_t triangle = corners_[i].triangle;
  if (crossed_[block_index(column, row)] || corners_[i + 1].triangle != triangle ||
      corners_[i + stride].triangle != triangle || corners_[i + stride + 1].triangle != triangle)
    return false;
  const PixelBox pixels =
      PixelBox{column * kBlockSide, row * kBlockSide, (column + 1) * kBlockSide, (row + 1) * kBlockSide}.clipped(
          width_, height_);
  const PlaneDepth plane = triangle == kNoTriangle ? PlaneDepth{} : plane_depth(mesh, triangle);
  for (int y = pixels.y0; y < pixels.y1; ++y)
    for (int x = pixels.x0; x < pixels.x1; ++x)
      room_[pixel_index(x, y)] = {triangle, plane.at(static_cast<float>(x), static_cast<float>(y))};
  return true;
}

VisibleSurfaces::PlaneDepth VisibleSurfaces::plane_depth(const RoomMesh& mesh, std::uint32_t triangle) const {
  const auto& t = mesh.triangles[triangle];
  const glm::vec3 p = mesh.vertices[t[0]];
  const glm::vec3 n = glm::cross(mesh.vertices[t[1]] - p, mesh.vertices[t[2]] - p);
  const float height = glm::dot(n, p - eye());
  return {glm::dot(n, rays_.corner) / height, glm::dot(n, rays_.right) / height, glm::dot(n, rays_.down) / height};
}

void VisibleSurfaces::trace_room_block(const PacketScene& room, int column, int row) {
  RayPacket16 rays;
  RayHits16 hits;
  const int x0 = column * kBlockSide, y0 = row * kBlockSide;
  for (int k = 0; k < kLanes; ++k)
    aim(rays, k, static_cast<float>(x0 + k % kBlockSide), static_cast<float>(y0 + k / kBlockSide));
  room.closest(0xFFFFu, rays, hits);
  for (int k = 0; k < kLanes; ++k) {
    const int x = x0 + k % kBlockSide, y = y0 + k / kBlockSide;
    if (x < width_ && y < height_)
      room_[pixel_index(x, y)] = {hits.triangle[k], hits.distance[k]};
  }
}

void VisibleSurfaces::trace_room(const PacketScene& room, const RoomMesh& mesh) {
  crossed_ = blocks_with_outlines(mesh, camera_, origin_, kBlockSide);
  corners_.resize(static_cast<std::size_t>(block_columns() + 1) * (block_rows() + 1));
  plain_.assign(blocks_.size(), 0);
  parallel_for(0, block_rows() + 1, [&](int row) { trace_corners(room, row); });
  parallel_for(tbb::blocked_range<int>(0, block_rows(), 4), [&](const tbb::blocked_range<int>& rows) {
    for (int row = rows.begin(); row != rows.end(); ++row)
      for (int column = 0; column < block_columns(); ++column) {
        const bool plain = fill_plain_block(mesh, column, row);
        plain_[block_index(column, row)] = plain;
        if (!plain)
          trace_room_block(room, column, row);
        bound_block(column, row);
      }
  });
}

} // namespace daylit
