#include <algorithm>
#include <array>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <tbb/blocked_range.h>

#include "runtime/trace/visible_surfaces.h"
#include "scene/core/parallel.h"

namespace daylit {

namespace {

// Offsets from the pixel's centre: no two samples share a row or a column.
constexpr float kSampleX[kCoverageSamples] = {0.0625f,  -0.0625f, 0.3125f, -0.1875f,
                                              -0.3125f, -0.4375f, 0.1875f, 0.4375f};
constexpr float kSampleY[kCoverageSamples] = {-0.1875f, 0.1875f,  0.0625f, -0.3125f,
                                              0.3125f,  -0.0625f, 0.4375f, -0.4375f};
constexpr int kEdgesPerBlock = kLanes / kCoverageSamples;
constexpr float kTurned = 0.95f; // cosine between normals: more and one pixel's light is not the next one's

} // namespace

void VisibleSurfaces::trace_object_block(const PacketScene& objects, int x0, int y0) {
  RayPacket16 rays;
  RayHits16 hits;
  std::uint32_t lanes = 0;
  for (int k = 0; k < kLanes; ++k) {
    const int x = x0 + k % kBlockSide, y = y0 + k / kBlockSide;
    aim(rays, k, static_cast<float>(x), static_cast<float>(y));
    if (!object_box_.contains(x, y))
      continue;
    lanes |= 1u << k;
    if (const RoomHit behind = room(x, y); behind.triangle != kNoTriangle)
      rays.tfar[k] = behind.depth;
  }
  objects.closest(lanes, rays, hits);
  for (int k = 0; k < kLanes; ++k)
    if (hits.triangle[k] != kNoTriangle)
      object_[object_index(x0 + k % kBlockSide, y0 + k / kBlockSide)] = {hits.triangle[k], hits.u[k], hits.v[k],
                                                                         hits.distance[k], kCoverageSamples};
}

/// n.m < kTurned |n| |m| of the shading normals.
bool VisibleSurfaces::turned(const ObjectHit& a, const ObjectHit& b) const {
  const auto normal = [&](const ObjectHit& hit) {
    const auto& t = shape_.triangles[hit.triangle];
    return (1.0f - hit.u - hit.v) * shape_.normals[t[0]] + hit.u * shape_.normals[t[1]] + hit.v * shape_.normals[t[2]];
  };
  if (a.triangle == b.triangle)
    return false;
  const glm::vec3 n = normal(a), m = normal(b);
  const float cosine = glm::dot(n, m);
  return cosine < 0.0f || cosine * cosine < kTurned * kTurned * glm::dot(n, n) * glm::dot(m, m);
}

bool VisibleSurfaces::neighbours_differ(int x, int y) const {
  const ObjectHit& here = object(x, y);
  const bool covered = here.triangle != kNoTriangle;
  for (int v = std::max(y - 1, 0); v <= std::min(y + 1, height_ - 1); ++v)
    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, width_ - 1); ++u)
      if ((object(u, v).triangle != kNoTriangle) != covered)
        return true;
  if (!covered || x == 0 || y == 0 || x + 1 >= width_ || y + 1 >= height_)
    return false;
  const std::array<const ObjectHit*, 4> around{&object(x - 1, y), &object(x + 1, y), &object(x, y - 1),
                                               &object(x, y + 1)};
  if (std::ranges::any_of(around, [&](const ObjectHit* next) { return turned(here, *next); }))
    return true;
  // The inverse depth of a plane is linear in the picture: its second difference shows a step.
  const auto bend = [&](const ObjectHit& before, const ObjectHit& after) {
    return std::fabs(1.0f / before.depth - 2.0f / here.depth + 1.0f / after.depth);
  };
  const float limit = apart_m_ / (here.depth * here.depth);
  return bend(*around[0], *around[1]) > limit || bend(*around[2], *around[3]) > limit;
}

void VisibleSurfaces::find_edges() {
  std::vector<std::vector<std::uint32_t>> rows(static_cast<std::size_t>(object_box_.height()));
  parallel_for(tbb::blocked_range<int>(object_box_.y0, object_box_.y1, 8), [&](const auto& range) {
    for (int y = range.begin(); y != range.end(); ++y)
      for (int x = object_box_.x0; x < object_box_.x1; ++x)
        if (neighbours_differ(x, y))
          rows[static_cast<std::size_t>(y - object_box_.y0)].push_back(static_cast<std::uint32_t>(y * width_ + x));
  });
  for (const auto& row : rows)
    for (const std::uint32_t pixel : row) {
      edges_.emplace_back().pixel = pixel;
      const glm::ivec2 at = edge_pixel(edges_.size() - 1);
      edge_of_pixel_[object_index(at.x, at.y)] = static_cast<std::uint32_t>(edges_.size() - 1);
    }
}

void VisibleSurfaces::add_sample(Edge& edge, int place, const ObjectHit& sample) const {
  const auto bit = static_cast<std::uint8_t>(1u << place);
  edge.sample[place] = sample;
  for (int h = 0; h < edge.hit_count; ++h) {
    const bool alike = std::fabs(edge.hits[h].depth - sample.depth) < apart_m_ && !turned(edge.hits[h], sample);
    if (alike || h + 1 == kMostEdgeHits) {
      ++edge.hits[h].samples;
      edge.hits[h].places |= bit;
      return;
    }
  }
  edge.hits[edge.hit_count] = sample;
  edge.hits[edge.hit_count++].places = bit;
}

void VisibleSurfaces::sample_edges(const PacketScene& objects, const SeenRoom& room, std::size_t first,
                                   std::size_t count) {
  RayPacket16 rays;
  RayHits16 room_hits, object_hits;
  std::uint32_t lanes = 0;
  for (int k = 0; k < kLanes; ++k) {
    const std::uint32_t pixel = edges_[first + std::min<std::size_t>(k / kCoverageSamples, count - 1)].pixel;
    const int s = k % kCoverageSamples;
    const int px = static_cast<int>(pixel) % width_, py = static_cast<int>(pixel) / width_;
    const float x = static_cast<float>(px) + kSampleX[s], y = static_cast<float>(py) + kSampleY[s];
    aim(rays, k, x, y);
    room_hits.triangle[k] = kNoTriangle;
    const std::uint32_t triangle = this->room(px, py).triangle;
    if (!is_plain(px / kBlockSide, py / kBlockSide))
      lanes |= 1u << k;
    else if (triangle != kNoTriangle) {
      room_hits.triangle[k] = triangle;
      room_hits.distance[k] = plane_depth(room.mesh, triangle).at(x, y);
    }
  }
  const std::uint32_t used = (1u << (count * kCoverageSamples)) - 1u;
  if (RayHits16 traced; lanes & used) {
    room.closest(lanes & used, rays, traced);
    for (int k = 0; k < kLanes; ++k)
      if (lanes >> k & 1u) {
        room_hits.triangle[k] = traced.triangle[k];
        room_hits.distance[k] = traced.distance[k];
      }
  }
  for (int k = 0; k < kLanes; ++k)
    if (room_hits.triangle[k] != kNoTriangle)
      rays.tfar[k] = room_hits.distance[k];
  objects.closest(used, rays, object_hits);
  for (std::size_t e = 0; e < count; ++e) {
    Edge& edge = edges_[first + e];
    for (int s = 0; s < kCoverageSamples; ++s) {
      const std::size_t k = e * kCoverageSamples + s;
      if (object_hits.triangle[k] != kNoTriangle)
        add_sample(edge, s, {object_hits.triangle[k], object_hits.u[k], object_hits.v[k], object_hits.distance[k], 1});
      else if (edge.room.triangle == kNoTriangle) {
        edge.room = {room_hits.triangle[k], room_hits.distance[k]};
        edge.room_sample = static_cast<std::uint8_t>(s);
      }
    }
    const glm::ivec2 at = edge_pixel(first + e);
    object_[object_index(at.x, at.y)] = edge.hits[0];
    if (edge.hit_count == 0 || room_edge(at.x, at.y).empty())
      continue;
    std::array<RoomPart, kCoverageSamples> behind;
    for (std::size_t s = 0; s < behind.size(); ++s) {
      const std::size_t k = e * kCoverageSamples + s;
      behind[s] = {room_hits.triangle[k], eye() + room_hits.distance[k] * sample_direction(at.x, at.y, s)};
    }
    find_uncovered(room.mesh, edge, behind);
  }
}

void VisibleSurfaces::trace_objects(const PacketScene& objects, const ObjectShape& shape, const SeenRoom& room,
                                    const PixelBox& box, float apart_m) {
  shape_ = shape;
  apart_m_ = apart_m;
  // One pixel around, so that the edges of the objects lie in the box.
  object_box_ =
      box.empty() ? PixelBox{} : PixelBox{box.x0 - 1, box.y0 - 1, box.x1 + 1, box.y1 + 1}.clipped(width_, height_);
  edges_.clear();
  const std::size_t pixels = static_cast<std::size_t>(object_box_.width()) * object_box_.height();
  object_.assign(pixels, {});
  edge_of_pixel_.assign(pixels, kNoEdge);
  if (object_box_.empty())
    return;
  const int first_row = object_box_.y0 / kBlockSide, last_row = (object_box_.y1 + kBlockSide - 1) / kBlockSide;
  parallel_for(tbb::blocked_range<int>(first_row, last_row), [&](const tbb::blocked_range<int>& rows) {
    for (int row = rows.begin(); row != rows.end(); ++row)
      for (int x = object_box_.x0 - object_box_.x0 % kBlockSide; x < object_box_.x1; x += kBlockSide)
        trace_object_block(objects, x, row * kBlockSide);
  });
  find_edges();
  parallel_for(tbb::blocked_range<std::size_t>(0, (edges_.size() + kEdgesPerBlock - 1) / kEdgesPerBlock, 32),
               [&](const auto& range) {
                 for (std::size_t b = range.begin(); b != range.end(); ++b)
                   sample_edges(objects, room, b * kEdgesPerBlock,
                                std::min<std::size_t>(kEdgesPerBlock, edges_.size() - b * kEdgesPerBlock));
               });
}

glm::vec3 VisibleSurfaces::sample_direction(int x, int y, std::size_t place) const {
  return direction(static_cast<float>(x) + kSampleX[place], static_cast<float>(y) + kSampleY[place]);
}

std::uint8_t VisibleSurfaces::uncovered_places(int x, int y) const {
  std::uint8_t covered = 0;
  for (const ObjectHit& hit : edge_hits(x, y))
    covered |= hit.places;
  return static_cast<std::uint8_t>(~covered);
}

RoomHit VisibleSurfaces::uncovered_room(int x, int y, glm::vec3& position) const {
  RoomHit hit = room(x, y);
  glm::vec2 p(x, y);
  if (const std::uint32_t edge = edge_of(x, y); edge != kNoEdge) {
    hit = edges_[edge].room;
    p += glm::vec2(kSampleX[edges_[edge].room_sample], kSampleY[edges_[edge].room_sample]);
  }
  position = eye() + hit.depth * direction(p.x, p.y);
  return hit;
}

} // namespace daylit
