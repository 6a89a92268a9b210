// Pixels in which the room shows several surfaces: what part of each.

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <tbb/blocked_range.h>

#include "runtime/trace/visible_surfaces.h"
#include "scene/core/parallel.h"

namespace daylit {

namespace {

constexpr float kRoomTurned = 0.95f;  // cosine between normals of surfaces whose light is told apart
constexpr float kRoomApart_px = 2.0f; // from the other's plane

/// Sixteen places in a pixel, none in a row or a column with another: (k + 1/2, 5 k + 2 mod 16 + 1/2) / 16 - 1/2.
glm::vec2 sample_offset(int k) {
  return (glm::vec2(k, (5 * k + 2) % kLanes) + 0.5f) / static_cast<float>(kLanes) - 0.5f;
}

} // namespace

/// Without objects.
std::span<const RoomPart> VisibleSurfaces::room_edge(int x, int y) const {
  const RoomBlock& block = room_[block_index(x / kBlockSide, y / kBlockSide)];
  if (block.first_hit == kPlain)
    return {};
  const std::uint32_t edge = room_edge_of_[block.first_hit + in_block(x, y)];
  if (edge == kNoEdge)
    return {};
  return room_edges_[edge].parts.span();
}

/// Hit `b` lies on another surface than `a`: turned, or off its plane.
bool VisibleSurfaces::room_differs(const RoomMesh& mesh, const RoomPart& a, const RoomPart& b) const {
  if (a.triangle == b.triangle)
    return false;
  if (a.triangle == kNoTriangle || b.triangle == kNoTriangle)
    return true;
  const glm::vec3& n = mesh.normals[a.triangle];
  return std::fabs(glm::dot(n, mesh.normals[b.triangle])) < kRoomTurned ||
         std::fabs(glm::dot(n, b.position - a.position)) >
             kRoomApart_px * pixel_pitch_ * glm::distance(a.position, eye());
}

/// In the middle of a pixel.
RoomPart VisibleSurfaces::room_part(int x, int y) const {
  const RoomHit hit = room(x, y);
  return {hit.triangle, eye() + hit.depth * direction(static_cast<float>(x), static_cast<float>(y)), 1.0f};
}

/// A pixel beside, above or below shows another surface: so it is wherever a straight edge crosses the pixel. It
/// passes its middle within (|n.x| + |n.y|) / 2, n its normal, and one of the four lies max(|n.x|, |n.y|) beyond that.
bool VisibleSurfaces::shows_room_edge(const RoomMesh& mesh, int x, int y) const {
  const std::uint32_t here = room_triangle(x, y);
  for (const glm::ivec2& step : {glm::ivec2(-1, 0), {1, 0}, {0, -1}, {0, 1}}) {
    const int u = std::clamp(x + step.x, 0, width_ - 1), v = std::clamp(y + step.y, 0, height_ - 1);
    if (room_triangle(u, v) != here && room_differs(mesh, room_part(x, y), room_part(u, v)))
      return true;
  }
  return false;
}

/// The last part takes what finds no place.
void VisibleSurfaces::add_room_sample(const RoomMesh& mesh, RoomParts& parts, const RoomPart& sample) const {
  for (std::size_t k = 0; k < parts.count; ++k) {
    RoomPart& part = parts.part[k];
    const bool differs = room_differs(mesh, part, sample);
    if (differs && k + 1 < kMostRoomParts)
      continue;
    part.fraction += sample.fraction;
    if (!differs)
      part.position += sample.fraction / part.fraction * (sample.position - part.position);
    return;
  }
  parts.part[parts.count++] = sample;
}

/// Stays without parts where there is one surface, or a window beside it.
void VisibleSurfaces::sample_room_edge(const SeenRoom& room, RoomEdge& edge) const {
  const glm::vec2 middle(static_cast<int>(edge.pixel) % width_, static_cast<int>(edge.pixel) / width_);
  RayPacket16 rays;
  RayHits16 hits;
  for (int k = 0; k < kLanes; ++k) {
    const glm::vec2 p = middle + sample_offset(k);
    aim(rays, k, p.x, p.y);
  }
  room.closest(0xFFFFu, rays, hits);
  for (int k = 0; k < kLanes; ++k) {
    if (hits.triangle[k] == kNoTriangle) {
      edge.parts = {};
      return;
    }
    const glm::vec2 p = middle + sample_offset(k);
    add_room_sample(room.mesh, edge.parts,
                    {hits.triangle[k], eye() + hits.distance[k] * direction(p.x, p.y), 1.0f / kLanes});
  }
  if (edge.parts.count == 1)
    edge.parts = {};
}

void VisibleSurfaces::find_room_edges(const SeenRoom& room) {
  std::vector<std::vector<RoomEdge>> rows(static_cast<std::size_t>(block_rows()));
  parallel_for(tbb::blocked_range<int>(0, block_rows(), 4), [&](const tbb::blocked_range<int>& range) {
    for (int row = range.begin(); row != range.end(); ++row)
      for (int column = 0; column < block_columns(); ++column)
        if (!is_plain(column, row))
          find_room_edges(room, column, row, rows[static_cast<std::size_t>(row)]);
  });
  room_edge_of_.assign(room_hits_.size(), kNoEdge);
  room_edges_.clear();
  for (const auto& row : rows)
    for (const RoomEdge& edge : row) {
      const int x = static_cast<int>(edge.pixel) % width_, y = static_cast<int>(edge.pixel) / width_;
      const RoomBlock& block = room_[block_index(x / kBlockSide, y / kBlockSide)];
      room_edge_of_[block.first_hit + in_block(x, y)] = static_cast<std::uint32_t>(room_edges_.size());
      room_edges_.push_back(edge);
    }
}

/// In one block.
void VisibleSurfaces::find_room_edges(const SeenRoom& room, int column, int row, std::vector<RoomEdge>& found) const {
  const PixelBox pixels =
      PixelBox{column * kBlockSide, row * kBlockSide, (column + 1) * kBlockSide, (row + 1) * kBlockSide}.clipped(
          width_, height_);
  for (int y = pixels.y0; y < pixels.y1; ++y)
    for (int x = pixels.x0; x < pixels.x1; ++x) {
      if (!shows_room_edge(room.mesh, x, y))
        continue;
      RoomEdge edge;
      edge.pixel = static_cast<std::uint32_t>(y * width_ + x);
      sample_room_edge(room, edge);
      if (edge.parts.count > 0)
        found.push_back(edge);
    }
}

/// `room`: what the samples of an object's edge show of the room, objects or not.
void VisibleSurfaces::find_uncovered(const RoomMesh& mesh, Edge& edge,
                                     std::span<const RoomPart, kCoverageSamples> room) const {
  const int x = static_cast<int>(edge.pixel) % width_, y = static_cast<int>(edge.pixel) / width_;
  for (RoomPart part : room_edge(x, y)) {
    int all = 0, free = 0, free_of_all = 0;
    glm::vec3 sum(0.0f);
    for (std::size_t s = 0; s < room.size(); ++s) {
      const bool is_free = edge.sample[s].triangle == kNoTriangle;
      free_of_all += is_free;
      if (room_differs(mesh, part, room[s]))
        continue;
      ++all;
      free += is_free;
      sum += is_free ? room[s].position : glm::vec3(0.0f);
    }
    part.uncovered = all > 0 ? static_cast<float>(free) / static_cast<float>(all)
                             : static_cast<float>(free_of_all) / kCoverageSamples;
    if (free > 0)
      part.position = sum / static_cast<float>(free);
    edge.room_parts.part[edge.room_parts.count++] = part;
  }
}

} // namespace daylit
