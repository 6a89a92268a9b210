#include "runtime/trace/visible_surfaces.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace daylit {

namespace {

// Offsets from the pixel's centre: no two samples share a row or a column.
constexpr float kSampleX[kCoverageSamples] = {0.0625f,  -0.0625f, 0.3125f, -0.1875f,
                                              -0.3125f, -0.4375f, 0.1875f, 0.4375f};
constexpr float kSampleY[kCoverageSamples] = {-0.1875f, 0.1875f,  0.0625f, -0.3125f,
                                              0.3125f,  -0.0625f, 0.4375f, -0.4375f};
constexpr int kEdgesPerBlock = kLanes / kCoverageSamples;

} // namespace

void VisibleSurfaces::set_camera(const RenderCamera& camera, const glm::dvec3& origin) {
  width_ = camera.width_px;
  height_ = camera.height_px;
  const glm::dmat3 axes(camera.world_from_camera);
  eye_ = glm::vec3(camera.eye() - origin);
  right_ = glm::vec3(axes[0] / camera.fx);
  down_ = glm::vec3(axes[1] / camera.fy);
  corner_ = glm::vec3(axes[2] - axes[0] * (camera.cx / camera.fx) - axes[1] * (camera.cy / camera.fy));
  const std::size_t pixels = static_cast<std::size_t>(width_) * height_;
  room_.resize(pixels);
  object_.assign(pixels, {});
  edge_of_pixel_.assign(pixels, kNoEdge);
  edges_.clear();
  object_box_ = {};
  blocks_.resize(static_cast<std::size_t>(block_columns()) * block_rows());
}

void VisibleSurfaces::aim(RayBlock& rays, int lane, float x, float y) const {
  const glm::vec3 d = direction(x, y);
  rays.org_x[lane] = eye_.x;
  rays.org_y[lane] = eye_.y;
  rays.org_z[lane] = eye_.z;
  rays.dir_x[lane] = d.x;
  rays.dir_y[lane] = d.y;
  rays.dir_z[lane] = d.z;
  rays.tnear[lane] = static_cast<float>(kNearPlane_m);
  rays.tfar[lane] = std::numeric_limits<float>::infinity();
}

void VisibleSurfaces::trace_room_block(const PacketScene& room, int column, int row) {
  RayBlock rays;
  HitBlock hits;
  const int x0 = column * kBlockSide, y0 = row * kBlockSide;
  for (int k = 0; k < kLanes; ++k)
    aim(rays, k, static_cast<float>(x0 + k % kBlockSide), static_cast<float>(y0 + k / kBlockSide));
  room.closest(0xFFFFu, rays, hits);
  glm::vec3 lo(std::numeric_limits<float>::infinity()), hi = -lo;
  for (int k = 0; k < kLanes; ++k) {
    const int x = x0 + k % kBlockSide, y = y0 + k / kBlockSide;
    if (x >= width_ || y >= height_)
      continue;
    room_[pixel_index(x, y)] = {hits.triangle[k], hits.distance[k]};
    if (hits.triangle[k] == kNoTriangle)
      continue;
    const glm::vec3 p = eye_ + hits.distance[k] * glm::vec3(rays.dir_x[k], rays.dir_y[k], rays.dir_z[k]);
    lo = glm::min(lo, p);
    hi = glm::max(hi, p);
  }
  blocks_[block_index(column, row)] =
      lo.x > hi.x ? BlockBound{} : BlockBound{0.5f * (lo + hi), 0.5001f * glm::length(hi - lo)};
}

void VisibleSurfaces::trace_room(const PacketScene& room) {
  tbb::parallel_for(tbb::blocked_range<int>(0, block_rows(), 4), [&](const tbb::blocked_range<int>& rows) {
    for (int row = rows.begin(); row != rows.end(); ++row)
      for (int column = 0; column < block_columns(); ++column)
        trace_room_block(room, column, row);
  });
}

void VisibleSurfaces::trace_object_block(const PacketScene& objects, int x0, int y0) {
  RayBlock rays;
  HitBlock hits;
  std::uint32_t lanes = 0;
  for (int k = 0; k < kLanes; ++k) {
    const int x = x0 + k % kBlockSide, y = y0 + k / kBlockSide;
    aim(rays, k, static_cast<float>(x), static_cast<float>(y));
    if (!object_box_.contains(x, y))
      continue;
    lanes |= 1u << k;
    const RoomHit& room = room_[pixel_index(x, y)];
    if (room.triangle != kNoTriangle)
      rays.tfar[k] = room.depth;
  }
  objects.closest(lanes, rays, hits);
  for (int k = 0; k < kLanes; ++k)
    if (hits.triangle[k] != kNoTriangle)
      object_[pixel_index(x0 + k % kBlockSide, y0 + k / kBlockSide)] = {hits.triangle[k], hits.u[k], hits.v[k],
                                                                        hits.distance[k], kCoverageSamples};
}

bool VisibleSurfaces::neighbours_differ(int x, int y, float apart_m) const {
  const ObjectHit& here = object_[pixel_index(x, y)];
  const bool covered = here.triangle != kNoTriangle;
  for (int v = std::max(y - 1, 0); v <= std::min(y + 1, height_ - 1); ++v)
    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, width_ - 1); ++u)
      if ((object_[pixel_index(u, v)].triangle != kNoTriangle) != covered)
        return true;
  if (!covered || x == 0 || y == 0 || x + 1 >= width_ || y + 1 >= height_)
    return false;
  // The inverse depth of a plane is linear in the picture: its second difference shows a step.
  const auto bend = [&](std::size_t before, std::size_t after) {
    return std::fabs(1.0f / object_[before].depth - 2.0f / here.depth + 1.0f / object_[after].depth);
  };
  const float limit = apart_m / (here.depth * here.depth);
  return bend(pixel_index(x - 1, y), pixel_index(x + 1, y)) > limit ||
         bend(pixel_index(x, y - 1), pixel_index(x, y + 1)) > limit;
}

void VisibleSurfaces::find_edges(float apart_m) {
  std::vector<std::vector<std::uint32_t>> rows(static_cast<std::size_t>(object_box_.height()));
  tbb::parallel_for(tbb::blocked_range<int>(object_box_.y0, object_box_.y1, 8), [&](const auto& range) {
    for (int y = range.begin(); y != range.end(); ++y)
      for (int x = object_box_.x0; x < object_box_.x1; ++x)
        if (neighbours_differ(x, y, apart_m))
          rows[static_cast<std::size_t>(y - object_box_.y0)].push_back(static_cast<std::uint32_t>(pixel_index(x, y)));
  });
  for (const auto& row : rows)
    for (const std::uint32_t pixel : row) {
      edge_of_pixel_[pixel] = static_cast<std::uint32_t>(edges_.size());
      edges_.emplace_back().pixel = pixel;
    }
}

void VisibleSurfaces::add_sample(Edge& edge, const ObjectHit& sample, float apart_m) const {
  for (int h = 0; h < edge.hit_count; ++h)
    if (std::fabs(edge.hits[h].depth - sample.depth) < apart_m || h + 1 == kMostEdgeHits) {
      ++edge.hits[h].samples;
      return;
    }
  edge.hits[edge.hit_count] = sample;
  edge.hits[edge.hit_count++].samples = 1;
}

void VisibleSurfaces::sample_edges(const PacketScene& objects, const PacketScene& room, std::size_t first,
                                   std::size_t count, float apart_m) {
  RayBlock rays;
  HitBlock room_hits, object_hits;
  for (int k = 0; k < kLanes; ++k) {
    const std::uint32_t pixel = edges_[first + std::min<std::size_t>(k / kCoverageSamples, count - 1)].pixel;
    const int s = k % kCoverageSamples;
    aim(rays, k, static_cast<float>(pixel % width_) + kSampleX[s], static_cast<float>(pixel / width_) + kSampleY[s]);
  }
  const std::uint32_t lanes = (1u << (count * kCoverageSamples)) - 1u;
  room.closest(lanes, rays, room_hits);
  for (int k = 0; k < kLanes; ++k)
    if (room_hits.triangle[k] != kNoTriangle)
      rays.tfar[k] = room_hits.distance[k];
  objects.closest(lanes, rays, object_hits);
  for (std::size_t e = 0; e < count; ++e) {
    Edge& edge = edges_[first + e];
    for (int s = 0; s < kCoverageSamples; ++s) {
      const std::size_t k = e * kCoverageSamples + s;
      if (object_hits.triangle[k] != kNoTriangle)
        add_sample(edge, {object_hits.triangle[k], object_hits.u[k], object_hits.v[k], object_hits.distance[k], 1},
                   apart_m);
      else if (edge.room.triangle == kNoTriangle) {
        edge.room = {room_hits.triangle[k], room_hits.distance[k]};
        edge.room_sample = static_cast<std::uint8_t>(s);
      }
    }
    object_[edge.pixel] = edge.hits[0];
  }
}

void VisibleSurfaces::clear_objects() {
  for (int y = object_box_.y0; y < object_box_.y1; ++y) {
    const auto first = static_cast<std::ptrdiff_t>(pixel_index(object_box_.x0, y));
    std::fill_n(object_.begin() + first, object_box_.width(), ObjectHit{});
    std::fill_n(edge_of_pixel_.begin() + first, object_box_.width(), kNoEdge);
  }
  edges_.clear();
}

void VisibleSurfaces::trace_objects(const PacketScene& objects, const PacketScene& room, const PixelBox& box,
                                    float apart_m) {
  clear_objects();
  // One pixel around, so that the edges of the objects lie in the box.
  object_box_ =
      box.empty() ? PixelBox{} : PixelBox{box.x0 - 1, box.y0 - 1, box.x1 + 1, box.y1 + 1}.clipped(width_, height_);
  if (object_box_.empty())
    return;
  const int first_row = object_box_.y0 / kBlockSide, last_row = (object_box_.y1 + kBlockSide - 1) / kBlockSide;
  tbb::parallel_for(tbb::blocked_range<int>(first_row, last_row), [&](const tbb::blocked_range<int>& rows) {
    for (int row = rows.begin(); row != rows.end(); ++row)
      for (int x = object_box_.x0 - object_box_.x0 % kBlockSide; x < object_box_.x1; x += kBlockSide)
        trace_object_block(objects, x, row * kBlockSide);
  });
  find_edges(apart_m);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, (edges_.size() + kEdgesPerBlock - 1) / kEdgesPerBlock, 32),
                    [&](const auto& range) {
                      for (std::size_t b = range.begin(); b != range.end(); ++b)
                        sample_edges(objects, room, b * kEdgesPerBlock,
                                     std::min<std::size_t>(kEdgesPerBlock, edges_.size() - b * kEdgesPerBlock),
                                     apart_m);
                    });
}

RoomHit VisibleSurfaces::uncovered_room(int x, int y, glm::vec3& position) const {
  const std::size_t i = pixel_index(x, y);
  RoomHit hit = room_[i];
  glm::vec2 p(x, y);
  if (const std::uint32_t edge = edge_of_pixel_[i]; edge != kNoEdge) {
    hit = edges_[edge].room;
    p += glm::vec2(kSampleX[edges_[edge].room_sample], kSampleY[edges_[edge].room_sample]);
  }
  position = eye_ + hit.depth * direction(p.x, p.y);
  return hit;
}

} // namespace daylit
