#pragma once

// What the objects take of the lights at the top left pixel of every block of pixels: on the objects, and on the room
// behind them. What lies between is interpolated, or knows from here which lights it need not ask about.
//
// Every second point of a row and column is coarse and always traced. A fine point between coarse ones that nearly
// agree takes their mean; else it is traced, but only for the lights that they disagree on. What a shadow is as wide as
// depends on the objects, not on the picture: where they are small in it every point is coarse, and where they are
// tiny there is no grid.

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/geometric.hpp>

#include "runtime/trace/traced_scene.h"
#include "runtime/trace/visible_surfaces.h"

namespace daylit {

enum class Layer : std::uint8_t { object, room };

struct GridPoint {
  bool exists = false;
  bool receives = false;                ///< its share is to be found; else nothing is lost
  bool traced = false;                  ///< its lights were asked one by one: ShareGrid::sky_words() knows them
  std::uint32_t triangle = kNoTriangle; ///< whose front is seen; none of the room
  glm::vec3 normal{0.0f}, position{0.0f}, start{0.0f};
  Rgb before{1.0f}, after{1.0f}; ///< shares of the open sky received without and with the objects
};

/// It lies close by, on the room in the same plane. `radius`: of the objects.
inline bool is_near(const GridPoint& g, Layer layer, const glm::vec3& position, const glm::vec3& normal, float radius) {
  constexpr float kSamePieceShare = 0.2f, kSamePlane_m = 1e-3f;
  const glm::vec3 d = position - g.position;
  const float reach = kSamePieceShare * radius;
  return layer == Layer::room ? std::fabs(glm::dot(d, normal)) < kSamePlane_m : glm::dot(d, d) < reach * reach;
}
/// A grid point of the layer speaks for points nearby on the same smooth piece of surface.
inline bool speaks_for(const GridPoint& g, Layer layer, const glm::vec3& position, const glm::vec3& normal,
                       float radius) {
  constexpr float kSameSideCosine = 0.8f;
  return g.exists && glm::dot(g.normal, normal) >= kSameSideCosine && is_near(g, layer, position, normal, radius);
}
/// It lies close by and faces the same way at all: what stands before it is likely to be the same.
inline bool stands_by(const GridPoint& g, Layer layer, const glm::vec3& position, const glm::vec3& normal,
                      float radius) {
  return g.exists && glm::dot(g.normal, normal) > 0.0f && is_near(g, layer, position, normal, radius);
}

class ShareGrid {
public:
  /// Traces the grid points of the blocks that touch `box`, and those on their far sides. `receives`: per block.
  /// Returns the number of rays.
  std::uint64_t trace(const TracedScene& scene, const VisibleSurfaces& view, std::span<const std::uint8_t> receives,
                      const PixelBox& box);

  /// Nothing is shared: every pixel asks for itself.
  bool empty() const { return points_.empty(); }
  int columns() const { return columns_; }
  int rows() const { return rows_; }
  const GridPoint& at(Layer layer, int column, int row) const { return points_[index(layer, column, row)]; }
  /// Of a traced point: a word for every 64 lights of the sky.
  const LightWord* sky_words(Layer layer, int column, int row) const {
    return &sky_words_[index(layer, column, row) * sky_word_count_];
  }
  std::span<const LightBits> sun_bits(Layer layer, int column, int row) const {
    return {&sun_bits_[index(layer, column, row) * sun_groups_], sun_groups_};
  }

private:
  std::size_t index(Layer layer, int column, int row) const {
    return (static_cast<std::size_t>(row) * columns_ + column) * 2 + static_cast<std::size_t>(layer);
  }
  bool is_coarse(int column, int row) const {
    return (((column - blocks_.x0) | (row - blocks_.y0)) & (stride_ - 1)) == 0;
  }
  bool choose_stride(const TracedScene& scene, const VisibleSurfaces& view);
  void mark_outlines(const VisibleSurfaces& view);
  void clear_points();
  GridPoint object_point_at(const TracedScene& scene, const VisibleSurfaces& view, int column, int row) const;
  GridPoint room_point_at(const TracedScene& scene, const VisibleSurfaces& view, std::span<const std::uint8_t> receives,
                          int column, int row) const;
  std::uint64_t find_row(const TracedScene& scene, const VisibleSurfaces& view, std::span<const std::uint8_t> receives,
                         int row);
  bool by_another_part(int column, int row, float radius) const;
  bool interpolate(Layer layer, int column, int row, float radius, std::vector<const LightWord*>& neighbours);
  std::uint64_t trace_tile(const TracedScene& scene, const PixelBox& tile, bool coarse);

  class Tracer;
  int columns_ = 0, rows_ = 0;
  int stride_ = 2;                       ///< blocks between coarse points, 1 or 2
  PixelBox blocks_;                      ///< that are traced, in blocks
  std::vector<std::uint8_t> at_outline_; ///< per block: its room counts though an object hides it
  std::vector<GridPoint> points_;        ///< per block and layer; old ones further than a block from blocks_
  std::vector<LightWord> sky_words_;     ///< per point and 64 lights of the sky
  std::vector<LightBits> sun_bits_;      ///< per point and group of lights
  std::size_t sky_word_count_ = 0, sun_groups_ = 0;
};

} // namespace daylit
