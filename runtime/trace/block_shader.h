#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/trace/share_grid.h"

namespace daylit {

/// Shades blocks of pixels of one frame; one per thread.
class BlockShader {
public:
  /// `receives`: per block of the picture, whether light may be lost on its way there.
  BlockShader(const ShareGrid& grid, std::span<const std::uint8_t> receives, const TracedScene& scene,
              const VisibleSurfaces& view, RenderedFrame& frame)
      : grid_(grid), receives_(receives), scene_(scene), view_(view), frame_(frame), casters_(scene.casters()) {
    for (Lanes* lanes : {&objects_, &outlines_, &room_})
      lanes->hints.reset(scene.sky.lights.size());
  }
  void shade(int column, int row);
  /// Shades what is left. Call at the end of each row of blocks: what shares a ray block must not depend on threads.
  void finish_row();
  std::uint64_t rays() const { return rays_; }

private:
  /// Shares of the open sky at a point.
  struct SkyShare {
    Rgb before{1.0f}, after{1.0f};
    bool known = false;
    bool between = false; ///< grid points on all sides speak for the point
  };
  struct ObjectLight {
    Rgb reflectance{0.0f}, indirect{0.0f}, open_sky{0.0f};
  };
  /// Points of one kind, up to a full set of lanes.
  struct Lanes {
    PointBlock points, starts;
    int count = 0;
    std::uint32_t unknown = 0;      ///< lanes whose share of the sky is to be traced
    std::size_t pixel[kLanes] = {}; ///< in the frame
    float coverage[kLanes] = {};    ///< of the pixel
    LightHints hints;               ///< for those
    SkyShare sky[kLanes];
    std::uint32_t triangle[kLanes] = {};
    ObjectLight light[kLanes];
  };

  ObjectLight light_at(const ObjectHit& hit, bool back) const;
  void show(const ObjectLight& light, const Rgb& direct, std::size_t pixel, float coverage);
  void add_object(const ObjectHit& hit, int x, int y);
  void add_room(int x, int y, float coverage);
  SkyShare interpolate(Layer layer, int x, int y, const glm::vec3& position, const glm::vec3& normal) const;
  void hint(Lanes& lanes, Layer layer, int x, int y, const glm::vec3& position, const glm::vec3& normal);
  void trace_unknown(Lanes& lanes, bool on_object);
  void shade_objects(Lanes& lanes, std::size_t sun_corner_count);
  void shade_room();
  void start_block(const PixelBox& pixels);
  /// The grid points at the corners of a block that shows one plane of the room, where they speak for all of it and
  /// there is no sun; null pointers elsewhere.
  std::array<const GridPoint*, 4> plain_corners(int column, int row) const;
  void shade_plain(const std::array<const GridPoint*, 4>& corners, const PixelBox& pixels);
  bool find_sun_corners(int column, int row, Layer layer);

  const ShareGrid& grid_;
  std::span<const std::uint8_t> receives_;
  const TracedScene& scene_;
  const VisibleSurfaces& view_;
  RenderedFrame& frame_;
  ShadowCasters casters_;
  Lanes objects_, outlines_, room_; ///< outlines: points of objects that no grid point speaks for, of several blocks
  BlockedLights sky_blocked_, sun_blocked_;
  std::array<std::span<const LightBits>, 4> sun_corners_;
  std::vector<const LightWord*> neighbours_;
  std::size_t sun_corner_count_ = 0; ///< 4 where the corners speak for the block, else 0
  std::uint64_t rays_ = 0;
};

} // namespace daylit
