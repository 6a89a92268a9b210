#pragma once

// What the room loses to the objects, in every pixel, from few points that are asked.
//
// First the corners of all blocks of pixels: every light at one pixel in sixteen. Between corners that lie on one plane
// and nearly agree, shares are interpolated. The pixels of other blocks, and those that show another plane, are asked
// one by one. How wide a shadow is depends on the objects, not on the picture: where they are small in it, every pixel
// is asked.

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/gl/light_points.h"
#include "runtime/gl/room_view.h"
#include "runtime/gl/shadow_reach.h"

namespace daylit {

/// Of direct light at a point of the room, as RenderedFrame has it.
struct RoomLoss {
  glm::vec3 lost_sky{0.0f};           ///< share of the open sky
  glm::vec3 shares{1.0f, 0.0f, 0.0f}; ///< of the sky, received without the objects; of the sun, received and lost
};

/// What the objects' picture shows within its box.
struct ObjectPixels {
  PixelBox box;
  std::vector<glm::vec4> pixels; ///< a: coverage
  glm::vec4 at(int x, int y) const {
    return box.contains(x, y) ? pixels[static_cast<std::size_t>(y - box.y0) * static_cast<std::size_t>(box.width()) +
                                       static_cast<std::size_t>(x - box.x0)]
                              : glm::vec4(0.0f);
  }
};

class RoomGrid {
public:
  struct Scene {
    const RoomView& view;
    const RoomBuffers& room;
    ShadowReach reach;
    float whole_sun = 0.0f; ///< sum of the normal irradiance's channels; 0: no sun
    bool share = true;      ///< else every pixel is asked
  };

  /// The calls of a frame, in this order; what is asked has to be answered before the next.
  const LightPoints& ask_corners(const Scene& scene);
  void take_corners(const Scene& scene, const LightAnswers& sky, const LightAnswers& sun);
  void choose_pixels(const Scene& scene, const ObjectPixels& objects);
  const LightPoints& sky_pixels() const { return sky_points_; }
  const LightPoints& sun_pixels() const { return sun_points_; }
  void fill(const Scene& scene, const ObjectPixels& objects, const LightAnswers& sky, const LightAnswers& sun,
            RenderedFrame& frame) const;

private:
  struct Corner {
    int plane = 0; ///< RoomView::plane_number
    bool asked = false;
    RoomLoss loss;
  };
  struct Block {
    std::uint16_t sky = 0, sun = 0;              ///< pixels that are asked, a bit each
    bool smooth_sky = false, smooth_sun = false; ///< the others on the corners' plane lie between
    bool reached = false;                        ///< by a shadow, perhaps
    int plane = 0;                               ///< of all four corners; 0: they are not asked or lie on several
    std::uint32_t first_sky = 0, first_sun = 0;
  };
  int columns_ = 0, rows_ = 0; ///< of blocks; corners: one more
  std::vector<Corner> corners_;
  std::vector<std::uint32_t> asked_corners_;
  std::vector<Block> blocks_;
  LightPoints corner_points_, sky_points_, sun_points_;

  const Corner& corner(int column, int row) const {
    return corners_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_ + 1) +
                    static_cast<std::size_t>(column)];
  }
  std::size_t block_index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column);
  }
  PixelBox block_pixels(const Scene& scene, int column, int row) const;
  void reach_corners(const Scene& scene);
  bool sun_agrees(const Scene& scene, int column, int row) const;
  Block look_at_corners(const Scene& scene, int column, int row) const;
  Block choose_block(const Scene& scene, const ObjectPixels& objects, int column, int row) const;
  void set_points(const Scene& scene, int column, int row);
  void interpolate(const Scene& scene, int column, int row, std::span<RoomLoss> losses) const;
  void find_losses(const Scene& scene, const LightAnswers& sky, const LightAnswers& sun, int column, int row,
                   std::span<RoomLoss> losses) const;
  void fill_block(const Scene& scene, const ObjectPixels& objects, const LightAnswers& sky, const LightAnswers& sun,
                  int column, int row, RenderedFrame& frame) const;
};

} // namespace daylit
