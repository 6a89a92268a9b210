#pragma once

// What each pixel of the drawn picture shows: a point of the room, a point of a virtual object, or both in part.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "runtime/render/pixel_box.h"
#include "runtime/render/render_camera.h"
#include "runtime/trace/packet_scene.h"

namespace daylit {

constexpr int kBlockSide = 4; ///< pixels: a block of pixels fills the lanes of a ray block
constexpr int kCoverageSamples = 8;

/// A pixel that shows an object: the object's point at one of its samples.
struct ObjectHit {
  std::uint32_t triangle = kNoTriangle;
  float u = 0.0f, v = 0.0f;
  std::uint8_t coverage = 0;    ///< of kCoverageSamples
  std::uint8_t room_sample = 0; ///< an uncovered sample, where coverage is partial
};

/// A point of the room as seen through a pixel.
struct RoomHit {
  std::uint32_t triangle = kNoTriangle; ///< of the room's ray scene
  float depth = 0.0f;                   ///< along the camera's axis, metres
};

/// Bounding sphere of the room points of one block.
struct BlockBound {
  glm::vec3 centre{0.0f};
  float radius = -1.0f; ///< negative: the block shows nothing of the room
};

/// Pixels inside an object are sampled at their centre; a pixel whose neighbours differ is an edge and takes
/// kCoverageSamples. Positions are metres relative to `origin`.
class VisibleSurfaces {
public:
  void set_camera(const RenderCamera& camera, const glm::dvec3& origin);
  void trace_room(const PacketScene& room);
  /// `box`: pixels that the objects may cover; everything outside it shows none.
  void trace_objects(const PacketScene& objects, const PacketScene& room, const PixelBox& box);

  int width_px() const { return width_; }
  int height_px() const { return height_; }
  int block_columns() const { return (width_ + kBlockSide - 1) / kBlockSide; }
  int block_rows() const { return (height_ + kBlockSide - 1) / kBlockSide; }
  const BlockBound& block(int column, int row) const { return blocks_[block_index(column, row)]; }
  const PixelBox& object_box() const { return object_box_; }

  const RoomHit& room(int x, int y) const { return room_[pixel_index(x, y)]; }
  const ObjectHit& object(int x, int y) const { return object_[pixel_index(x, y)]; }
  /// The room's point that a pixel shows beside the object: its centre, or an uncovered sample of an edge.
  RoomHit uncovered_room(int x, int y, glm::vec3& position) const;
  /// Direction of unit depth through a pixel position.
  glm::vec3 direction(float x, float y) const { return corner_ + x * right_ + y * down_; }
  const glm::vec3& eye() const { return eye_; }
  std::size_t object_pixels() const { return object_pixels_; }
  std::size_t edge_pixels() const { return edges_.size(); }

private:
  std::size_t pixel_index(int x, int y) const { return static_cast<std::size_t>(y) * width_ + x; }
  std::size_t block_index(int column, int row) const {
    return static_cast<std::size_t>(row) * block_columns() + column;
  }
  void aim(RayBlock& rays, int lane, float x, float y) const;
  void trace_room_block(const PacketScene& room, int column, int row);
  void trace_object_block(const PacketScene& objects, int x0, int y0);
  bool is_edge(int x, int y) const;
  void sample_edges(const PacketScene& objects, const PacketScene& room, std::size_t first, std::size_t count);

  int width_ = 0, height_ = 0;
  glm::vec3 eye_{0.0f}, corner_{0.0f}, right_{0.0f}, down_{0.0f};
  std::vector<RoomHit> room_;
  std::vector<ObjectHit> object_;
  std::vector<BlockBound> blocks_;
  std::vector<std::uint32_t> edges_; ///< pixel indices, ascending
  std::vector<RoomHit> edge_room_;   ///< of the uncovered sample, one per edge
  std::vector<std::uint32_t> edge_of_pixel_;
  PixelBox object_box_;
  std::size_t object_pixels_ = 0;
};

} // namespace daylit
