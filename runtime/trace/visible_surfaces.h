#pragma once

// What each pixel of the drawn picture shows: a point of the room, a point of a virtual object, or both in part.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "runtime/base/pixel_box.h"
#include "runtime/base/render_camera.h"
#include "runtime/picture/picture_renderer.h"
#include "runtime/trace/seen_room.h"

namespace daylit {

/// Where the picture shows one plane of the room and nothing else: there one ray per block of pixels is enough.
/// Per block of `side` x `side` pixels, row-major: 0 when no edge of a triangle crosses the square from its first pixel
/// to the first pixels of the next blocks, a margin of half a pixel around it. Conservative. The visible surface then
/// changes in the square only where triangles cross each other; four corners that show the same triangle rule that out.
std::vector<std::uint8_t> blocks_with_outlines(const RoomMesh& room, const PinholeCamera& camera,
                                               const glm::dvec3& origin, int side);

/// The objects' surface as it is shaded: a normal per vertex.
struct ObjectShape {
  std::span<const std::array<std::uint32_t, 3>> triangles;
  std::span<const glm::vec3> normals;
};

constexpr int kBlockSide = 4; ///< pixels: a block of pixels fills the lanes of a ray block
constexpr int kCoverageSamples = 8;

/// A point of an object that stands for `samples` of a pixel's kCoverageSamples.
struct ObjectHit {
  std::uint32_t triangle = kNoTriangle;
  float u = 0.0f, v = 0.0f, depth = 0.0f;
  std::uint8_t samples = 0;
  std::uint8_t places = 0; ///< which samples of an edge pixel; 0: its middle
};

/// A point of the room as seen through a pixel.
struct RoomHit {
  std::uint32_t triangle = kNoTriangle; ///< of the room's ray scene
  float depth = 0.0f;                   ///< along the camera's axis, metres
};

/// One surface of the room of several in a pixel.
struct RoomPart {
  std::uint32_t triangle = kNoTriangle; ///< of the room's ray scene
  glm::vec3 position{0.0f};             ///< on its plane, in the middle of what the pixel shows
  float fraction = 0.0f;                ///< of the pixel, objects or not
  float uncovered = 1.0f;               ///< of that: not behind objects
};

/// Bounding sphere of the room points of one block.
struct BlockBound {
  glm::vec3 centre{0.0f};
  float radius = -1.0f; ///< negative: the block shows nothing of the room
};

/// Pixels inside an object are sampled at their centre. A pixel at an object's outline, where one part of it stands
/// before another, or where it bends sharply, is an edge: it takes kCoverageSamples, and as many points as lie apart in
/// depth or are turned another way. Positions are metres relative to `origin`.
class VisibleSurfaces {
public:
  void set_camera(const PinholeCamera& camera, const glm::dvec3& origin);
  void trace_room(const SeenRoom& room);
  /// `box`: pixels that the objects may cover; everything outside it shows none.
  /// `apart_m`: surfaces further apart in depth are shaded separately.
  void trace_objects(const PacketScene& objects, const ObjectShape& shape, const SeenRoom& room, const PixelBox& box,
                     float apart_m);

  int width_px() const { return width_; }
  int height_px() const { return height_; }
  int block_columns() const { return (width_ + kBlockSide - 1) / kBlockSide; }
  int block_rows() const { return (height_ + kBlockSide - 1) / kBlockSide; }
  const BlockBound& block(int column, int row) const { return blocks_[block_index(column, row)]; }
  /// The block shows one plane of the room, and so do the first pixels of the next blocks.
  bool is_plain(int column, int row) const { return room_[block_index(column, row)].first_hit == kPlain; }
  const PixelBox& object_box() const { return object_box_; }

  RoomHit room(int x, int y) const {
    const RoomBlock& block = room_[block_index(x / kBlockSide, y / kBlockSide)];
    if (block.first_hit == kPlain)
      return {block.triangle, block.plane.at(static_cast<float>(x), static_cast<float>(y))};
    return room_hits_[block.first_hit + in_block(x, y)];
  }
  /// Of a pixel that an edge of the room crosses, objects or not; empty for others. A photograph shows their mean.
  std::span<const RoomPart> room_parts(int x, int y) const {
    const std::uint32_t edge = edge_of(x, y);
    return edge != kNoEdge && edges_[edge].hit_count > 0 ? edges_[edge].room_parts.span() : room_edge(x, y);
  }
  /// The first, or only, point of the objects in a pixel.
  const ObjectHit& object(int x, int y) const {
    static constexpr ObjectHit kNone;
    return object_box_.contains(x, y) ? object_[object_index(x, y)] : kNone;
  }
  bool is_edge(int x, int y) const { return edge_of(x, y) != kNoEdge; }
  /// The room shows beside an object.
  bool is_outline(int x, int y) const {
    const std::uint32_t edge = edge_of(x, y);
    return edge != kNoEdge && edges_[edge].room.triangle != kNoTriangle;
  }
  /// All points of the objects in an edge pixel.
  std::span<const ObjectHit> edge_hits(int x, int y) const {
    const Edge& e = edges_[edge_of(x, y)];
    return {e.hits.data(), static_cast<std::size_t>(e.hit_count)};
  }
  /// What each sample of an edge pixel shows: where bits of ObjectHit::places are set.
  std::span<const ObjectHit, kCoverageSamples> edge_samples(int x, int y) const { return edges_[edge_of(x, y)].sample; }
  /// Of unit depth through sample `place` of an edge pixel.
  glm::vec3 sample_direction(int x, int y, std::size_t place) const;
  /// The samples of an edge pixel in which no object is seen, as bits.
  std::uint8_t uncovered_places(int x, int y) const;
  /// The room's point that a pixel shows beside the object: its centre, or an uncovered sample of an edge.
  RoomHit uncovered_room(int x, int y, glm::vec3& position) const;
  /// Direction of unit depth through a pixel position.
  glm::vec3 direction(float x, float y) const { return rays_.ray(x, y); }
  const glm::vec3& eye() const { return rays_.eye; }
  /// How large a sphere appears; at least its size where the camera stands in it.
  float radius_px(const glm::vec3& centre, float radius) const {
    const glm::vec3 d = centre - eye();
    return radius / (std::max(std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z), radius) * pixel_pitch_);
  }
  float pixel_pitch() const { return pixel_pitch_; } ///< at unit depth
  std::size_t edge_pixels() const { return edges_.size(); }
  glm::ivec2 edge_pixel(std::size_t k) const {
    return {static_cast<int>(edges_[k].pixel) % width_, static_cast<int>(edges_[k].pixel) / width_};
  }

private:
  static constexpr std::uint32_t kNoEdge = 0xFFFFFFFFu;
  static constexpr int kMostEdgeHits = 3;
  struct RoomParts {
    std::array<RoomPart, kMostRoomParts> part{};
    std::size_t count = 0;
    std::span<const RoomPart> span() const { return {part.data(), count}; }
  };
  struct RoomEdge {
    std::uint32_t pixel = 0;
    RoomParts parts;
  };
  struct Edge {
    std::uint32_t pixel = 0;
    std::array<ObjectHit, kMostEdgeHits> hits{};
    int hit_count = 0;
    std::array<ObjectHit, kCoverageSamples> sample{};
    RoomHit room; ///< at the first uncovered sample
    std::uint8_t room_sample = 0;
    RoomParts room_parts; ///< where several surfaces of the room show, and an object
  };
  std::size_t block_index(int column, int row) const {
    return static_cast<std::size_t>(row) * block_columns() + column;
  }
  static std::size_t in_block(int x, int y) {
    return static_cast<std::size_t>(y % kBlockSide * kBlockSide + x % kBlockSide);
  }
  /// Of a pixel in the objects' box.
  std::size_t object_index(int x, int y) const {
    return static_cast<std::size_t>(y - object_box_.y0) * object_box_.width() +
           static_cast<std::size_t>(x - object_box_.x0);
  }
  std::uint32_t edge_of(int x, int y) const {
    return object_box_.contains(x, y) ? edge_of_pixel_[object_index(x, y)] : kNoEdge;
  }
  void aim(RayPacket16& rays, int lane, float x, float y) const;
  /// The inverse depth of a plane is linear in the picture.
  struct PlaneDepth {
    float constant = 0.0f, per_x = 0.0f, per_y = 0.0f;
    float at(float x, float y) const { return 1.0f / (constant + per_x * x + per_y * y); }
  };
  /// What a block shows of the room: one triangle, or a hit for each of its pixels.
  static constexpr std::uint32_t kPlain = 0xFFFFFFFFu;
  struct RoomBlock {
    PlaneDepth plane; ///< of a plain block
    std::uint32_t triangle = kNoTriangle;
    std::uint32_t first_hit = kPlain; ///< in room_hits_
  };
  PlaneDepth plane_depth(const RoomMesh& mesh, std::uint32_t triangle) const;
  void trace_corners(const SeenRoom& room, int row);
  bool shows_one_triangle(int column, int row) const;
  /// At the first pixel of a block, or behind the last.
  const RoomHit& corner(int column, int row) const {
    return corners_[static_cast<std::size_t>(row) * (static_cast<std::size_t>(block_columns()) + 1) +
                    static_cast<std::size_t>(column)];
  }
  void trace_room_block(const SeenRoom& room, int column, int row);
  void bound_block(int column, int row);
  std::uint32_t room_triangle(int x, int y) const {
    const RoomBlock& block = room_[block_index(x / kBlockSide, y / kBlockSide)];
    return block.first_hit == kPlain ? block.triangle : room_hits_[block.first_hit + in_block(x, y)].triangle;
  }
  RoomPart room_part(int x, int y) const;
  bool room_differs(const RoomMesh& mesh, const RoomPart& a, const RoomPart& b) const;
  bool shows_room_edge(const RoomMesh& mesh, int x, int y) const;
  void find_room_edges(const SeenRoom& room);
  void find_room_edges(const SeenRoom& room, int column, int row, std::vector<RoomEdge>& found) const;
  void sample_room_edge(const SeenRoom& room, RoomEdge& edge) const;
  void add_room_sample(const RoomMesh& mesh, RoomParts& parts, const RoomPart& sample) const;
  std::span<const RoomPart> room_edge(int x, int y) const;
  void find_uncovered(const RoomMesh& mesh, Edge& edge, std::span<const RoomPart, kCoverageSamples> room) const;
  void trace_object_block(const PacketScene& objects, int x0, int y0);
  bool neighbours_differ(int x, int y) const;
  bool turned(const ObjectHit& a, const ObjectHit& b) const;
  void find_edges();
  void sample_edges(const PacketScene& objects, const SeenRoom& room, std::size_t first, std::size_t count);
  void add_sample(Edge& edge, int place, const ObjectHit& sample) const;

  int width_ = 0, height_ = 0;
  PinholeCamera camera_;
  glm::dvec3 origin_{0.0};
  float pixel_pitch_ = 1.0f; ///< at unit depth
  PixelRays rays_;
  std::vector<RoomBlock> room_;             ///< per block
  std::vector<RoomHit> room_hits_;          ///< sixteen for every block that is not plain
  std::vector<RoomEdge> room_edges_;        ///< ascending pixels
  std::vector<std::uint32_t> room_edge_of_; ///< of room_hits_
  std::vector<ObjectHit> object_;           ///< in the objects' box
  std::vector<BlockBound> blocks_;
  std::vector<std::uint8_t> crossed_;        ///< per block: by an edge of the room
  std::vector<RoomHit> corners_;             ///< at the first pixel of every block, one more at the ends
  std::vector<Edge> edges_;                  ///< ascending pixels
  std::vector<std::uint32_t> edge_of_pixel_; ///< in the objects' box
  PixelBox object_box_;
  ObjectShape shape_; ///< while the objects are traced
  float apart_m_ = 0.0f;
};

} // namespace daylit
