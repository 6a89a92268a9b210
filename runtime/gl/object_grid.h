#pragma once

// The shares of the sky's light that objects take from themselves, in every pixel, from few that are asked: as in
// room_grid.h, but pieces of curved surface speak for each other only where they lie close by and face the same way.
// Where another part of the objects stands beside, every pixel is asked: there shadows are narrow.

#include <cstdint>
#include <vector>

#include "runtime/base/pixel_box.h"
#include "runtime/gl/light_points.h"

namespace daylit {

/// One point per pixel of the box, row-major (shaders/object_point_fragment.glsl).
struct ObjectPoints {
  PixelBox box;
  std::vector<glm::vec4> offset; ///< xyz: from the centre of the objects' sphere; w: 1 where there is a point
  std::vector<glm::vec4> normal; ///< xyz: unit; w: 1 where the pixel shows other things as well
};

class ObjectGrid {
public:
  /// The calls of a frame, in this order; what is asked has to be answered before the next. `radius`: of the sphere.
  const LightPoints& ask_corners(const ObjectPoints& points, float radius);
  /// Sets `shares`, of which `unblocked` is 1, where pixels lie between corners; those without a point are left alone.
  const LightPoints& ask_pixels(const ObjectPoints& points, const LightAnswers& corners, LightAnswers& shares);
  /// The others.
  void fill(const LightAnswers& pixels, LightAnswers& shares) const;

private:
  struct Share {
    glm::vec3 lost{0.0f}, past{1.0f}; ///< taken by the objects, received past the room
  };
  int columns_ = 0, rows_ = 0; ///< of blocks
  float radius_ = 0.0f;
  std::vector<std::int32_t> corner_; ///< per block, its first pixel's place among those asked; -1: none speaks
  std::vector<Share> corner_shares_;
  std::vector<std::uint8_t> asks_; ///< per pixel of the box
  std::vector<std::uint32_t> asked_pixels_;
  LightPoints corner_points_, pixel_points_;

  std::int32_t corner(int column, int row) const {
    return column < columns_ && row < rows_ ? corner_[static_cast<std::size_t>(row * columns_ + column)] : -1;
  }
  bool same_piece(const ObjectPoints& points, std::size_t a, std::size_t b) const;
  bool interpolate(const ObjectPoints& points, int x, int y, Share& share) const;
  static Share share_of(const LightAnswers& answers, std::size_t k);
};

} // namespace daylit
