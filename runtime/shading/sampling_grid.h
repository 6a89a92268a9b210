#pragma once

// The adaptive sampling grid: visibility of the sky at few pixels, and what may be interpolated between them (in the
// spirit of irradiance caching, Ward et al. 1988, and of the regular image-space grid of Bala et al. 2003).
//
// The first pixel of every block of 4 x 4 is a grid point, on the objects and on the room behind them. Every second
// point of a row and column is coarse and always evaluated. A fine point between coarse ones that nearly agree takes
// their mean; else it is evaluated, but only for the lights that they disagree on. How wide a shadow is depends on the
// objects, not on the picture: where they are small in it every point is coarse, and where they are tiny there is no
// grid. On the room, far behind the objects, where the shadows of few lights would be seen one by one, points are meant
// with their neighbours (soften_grid.cpp).

#include <array>
#include <vector>

#include "runtime/picture/picture_renderer.h"
#include "runtime/shading/visibility.h"

namespace daylit {

struct GridPoint {
  PixelSurface surface;
  bool evaluated = false; ///< its lights were looked at one by one: SamplingGrid knows them
  SkyFractions sky;
  bool is_soft = false; ///< of the room, so far behind the objects that no shadow there is narrower than the grid
};

class SamplingGrid {
public:
  static constexpr int kBlockSide = RenderedFrame::kBlock; ///< pixels

  /// Evaluates the grid points of the blocks that touch the picture's box, and those on their far sides. Returns the
  /// number of rays.
  std::uint64_t evaluate(const Visibility& visibility, const SampledPicture& picture);
  /// Nothing is known: every pixel is evaluated by itself.
  void clear() { points_.clear(); }
  bool empty() const { return points_.empty(); }

  struct Interpolated {
    SkyFractions sky;
    bool is_known = false;
    bool is_between = false; ///< grid points on all sides are valid for the point
  };
  /// Bilinear between the corners of the pixel's block that lie on its smooth part of the surface; not known where they
  /// differ too much in any channel.
  Interpolated interpolate(Layer layer, int x, int y, const glm::vec3& position, const glm::vec3& normal) const;
  /// Adds to a lane's hints what the evaluated points around say. How they are turned does not matter here, only what
  /// stands before them.
  void add_hints(Layer layer, int x, int y, const glm::vec3& position, const glm::vec3& normal, int lane,
                 LightHints& hints) const;

  /// The corners of a block of which all pixels lie on one plane of the room, where it may be interpolated between
  /// them; null pointers elsewhere.
  using Corners = std::array<const GridPoint*, 4>; ///< row by row
  Corners plain_corners(int column, int row) const;
  /// What the corners of a block know of the sun, when all are valid for each other, and the points around them that
  /// are valid too: its shadows are too sharp for interpolation, but what all agree on holds between the corners.
  /// Without those around, the tip of a shadow that ends between four corners is cut off.
  struct SunCorners {
    std::array<const KnownLights*, 16> objects{}, room{};
    std::size_t count = 0; ///< 4 to 16, or 0 where the corners differ
  };
  SunCorners sun_corners(Layer layer, int column, int row) const;

private:
  /// Of a block of `blocks_`.
  std::size_t block_index(int column, int row) const {
    return static_cast<std::size_t>(row - blocks_.y0) * blocks_.width() + static_cast<std::size_t>(column - blocks_.x0);
  }
  std::size_t index(Layer layer, int column, int row) const {
    return 2 * block_index(column, row) + static_cast<std::size_t>(layer);
  }
  bool has_corners(int column, int row) const {
    return blocks_.contains(column, row) && blocks_.contains(column + 1, row + 1);
  }
  const GridPoint& at(Layer layer, int column, int row) const { return points_[index(layer, column, row)]; }
  bool shows_edge(int column, int row) const {
    return blocks_.contains(column, row) && has_edge_[block_index(column, row)] != 0;
  }
  bool is_coarse(int column, int row) const {
    return (((column - blocks_.x0) | (row - blocks_.y0)) & (stride_ - 1)) == 0;
  }
  /// A word for every 64 lights of the sky, or of the sun.
  std::span<KnownLights> words_of(std::vector<KnownLights>& words, std::size_t point, std::size_t lights) const {
    return std::span(words).subspan(point * words_for(lights), words_for(lights));
  }
  bool is_valid_for(const GridPoint& g, Layer layer, const glm::vec3& position, const glm::vec3& normal) const;
  bool is_near(const GridPoint& g, Layer layer, const glm::vec3& position, const glm::vec3& normal) const;
  void start(const SampledPicture& picture);
  void mark_outlines(std::span<const glm::ivec2> pixels);
  std::uint64_t find_row(const Visibility& visibility, int row);
  bool is_beside_another_part(int column, int row) const;
  bool interpolate_fine(Layer layer, int column, int row, std::vector<const KnownLights*>& neighbours);
  std::uint64_t evaluate_tile(const Visibility& visibility, const PixelBox& tile, bool coarse);

  void soften(const SampledPicture& picture);
  struct Mean {
    Rgb value{0.0f};
    float weight = 0.0f;
  };
  Mean mean_along(const glm::ivec2& step, std::span<const Rgb> values, float reach, int column, int row) const;

  class Collector;
  int stride_ = 2;                       ///< blocks between coarse points, 1 or 2
  float radius_ = 0.0f;                  ///< of the objects, metres
  PixelBox blocks_;                      ///< that are evaluated, in blocks; only these are kept
  std::vector<std::uint8_t> at_outline_; ///< per block: its room counts though an object hides it
  std::vector<std::uint8_t> has_edge_;   ///< per block: an object ends or bends sharply in it
  std::vector<GridPoint> points_;        ///< per block and layer
  std::size_t sky_lights_ = 0, sun_lights_ = 0;
  std::vector<KnownLights> sky_words_, sun_words_, sun_room_words_; ///< per point
};

} // namespace daylit
