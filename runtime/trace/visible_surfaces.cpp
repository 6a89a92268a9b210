#include "runtime/trace/visible_surfaces.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include "scene/core/parallel.h"

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
  const bool same_size = camera.width_px == width_ && camera.height_px == height_;
  if (same_size)
    clear_objects();
  width_ = camera.width_px;
  height_ = camera.height_px;
  camera_ = camera;
  origin_ = origin;
  const glm::dmat3 axes(camera.world_from_camera);
  eye_ = glm::vec3(camera.eye() - origin);
  right_ = glm::vec3(axes[0] / camera.fx);
  down_ = glm::vec3(axes[1] / camera.fy);
  pixel_pitch_ = static_cast<float>(1.0 / std::max(camera.fx, camera.fy));
  corner_ = glm::vec3(axes[2] - axes[0] * (camera.cx / camera.fx) - axes[1] * (camera.cy / camera.fy));
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

void VisibleSurfaces::bound_block(int column, int row) {
  const PixelBox pixels =
      PixelBox{column * kBlockSide, row * kBlockSide, (column + 1) * kBlockSide, (row + 1) * kBlockSide}.clipped(
          width_, height_);
  glm::vec3 lo(std::numeric_limits<float>::infinity()), hi = -lo;
  const auto include = [&](int x, int y) {
    const RoomHit& hit = room_[pixel_index(x, y)];
    if (hit.triangle == kNoTriangle)
      return;
    const glm::vec3 p = eye_ + hit.depth * direction(static_cast<float>(x), static_cast<float>(y));
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
  RayBlock rays;
  HitBlock hits;
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
  const float height = glm::dot(n, p - eye_);
  return {glm::dot(n, corner_) / height, glm::dot(n, right_) / height, glm::dot(n, down_) / height};
}

void VisibleSurfaces::trace_room_block(const PacketScene& room, int column, int row) {
  RayBlock rays;
  HitBlock hits;
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
  parallel_for(tbb::blocked_range<int>(object_box_.y0, object_box_.y1, 8), [&](const auto& range) {
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

void VisibleSurfaces::sample_edges(const PacketScene& objects, const PacketScene& room, const RoomMesh& mesh,
                                   std::size_t first, std::size_t count, float apart_m) {
  RayBlock rays;
  HitBlock room_hits, object_hits;
  std::uint32_t lanes = 0;
  for (int k = 0; k < kLanes; ++k) {
    const std::uint32_t pixel = edges_[first + std::min<std::size_t>(k / kCoverageSamples, count - 1)].pixel;
    const int s = k % kCoverageSamples;
    const int px = static_cast<int>(pixel) % width_, py = static_cast<int>(pixel) / width_;
    const float x = static_cast<float>(px) + kSampleX[s], y = static_cast<float>(py) + kSampleY[s];
    aim(rays, k, x, y);
    room_hits.triangle[k] = kNoTriangle;
    const std::uint32_t triangle = room_[pixel_index(px, py)].triangle;
    if (!is_plain(px / kBlockSide, py / kBlockSide))
      lanes |= 1u << k;
    else if (triangle != kNoTriangle) {
      room_hits.triangle[k] = triangle;
      room_hits.distance[k] = plane_depth(mesh, triangle).at(x, y);
    }
  }
  const std::uint32_t used = (1u << (count * kCoverageSamples)) - 1u;
  if (HitBlock traced; lanes & used) {
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
  parallel_for(tbb::blocked_range<int>(object_box_.y0, object_box_.y1, 32), [&](const auto& rows) {
    for (int y = rows.begin(); y != rows.end(); ++y) {
      const auto first = static_cast<std::ptrdiff_t>(pixel_index(object_box_.x0, y));
      std::fill_n(object_.begin() + first, object_box_.width(), ObjectHit{});
      std::fill_n(edge_of_pixel_.begin() + first, object_box_.width(), kNoEdge);
    }
  });
  edges_.clear();
}

void VisibleSurfaces::trace_objects(const PacketScene& objects, const PacketScene& room, const RoomMesh& mesh,
                                    const PixelBox& box, float apart_m) {
  clear_objects();
  // One pixel around, so that the edges of the objects lie in the box.
  object_box_ =
      box.empty() ? PixelBox{} : PixelBox{box.x0 - 1, box.y0 - 1, box.x1 + 1, box.y1 + 1}.clipped(width_, height_);
  if (object_box_.empty())
    return;
  const int first_row = object_box_.y0 / kBlockSide, last_row = (object_box_.y1 + kBlockSide - 1) / kBlockSide;
  parallel_for(tbb::blocked_range<int>(first_row, last_row), [&](const tbb::blocked_range<int>& rows) {
    for (int row = rows.begin(); row != rows.end(); ++row)
      for (int x = object_box_.x0 - object_box_.x0 % kBlockSide; x < object_box_.x1; x += kBlockSide)
        trace_object_block(objects, x, row * kBlockSide);
  });
  find_edges(apart_m);
  parallel_for(tbb::blocked_range<std::size_t>(0, (edges_.size() + kEdgesPerBlock - 1) / kEdgesPerBlock, 32),
               [&](const auto& range) {
                 for (std::size_t b = range.begin(); b != range.end(); ++b)
                   sample_edges(objects, room, mesh, b * kEdgesPerBlock,
                                std::min<std::size_t>(kEdgesPerBlock, edges_.size() - b * kEdgesPerBlock), apart_m);
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
