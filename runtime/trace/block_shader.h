#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/shading/sampling_grid.h"
#include "runtime/trace/ray_visibility.h"
#include "runtime/trace/surface_points.h"

namespace daylit {

/// Shades blocks of pixels of one frame; one per thread.
class BlockShader {
public:
  /// `receives`: per block of the picture, whether light may be lost on its way there.
  BlockShader(const SamplingGrid& grid, const RayVisibility& visibility, std::span<const std::uint8_t> receives,
              const TracedScene& scene, const VisibleSurfaces& view, RenderedFrame& frame);
  void shade(int column, int row);
  /// Shades what is left. Call at the end of each row of blocks: which points form a packet must not depend on threads.
  void finish_row();
  std::uint64_t rays() const { return rays_; }

private:
  static constexpr std::uint32_t kWhole = 0xFFFFFFFFu;
  struct ObjectLight {
    Rgb reflectance{0.0f}, indirect{0.0f}, open_sky{0.0f};
  };
  /// Points of one layer, and what is drawn of them.
  struct Batch {
    PointSet set;
    LaneMask unknown = 0; ///< lanes whose sky is to be looked at
    glm::ivec2 pixel[kLanes] = {};
    float coverage[kLanes] = {};      ///< of the pixel
    std::uint8_t places[kLanes] = {}; ///< of an edge pixel, as in ObjectHit
    std::uint32_t triangle[kLanes] = {};
    bool below[kLanes] = {};         ///< the sun stands below the facet of a sharp edge
    std::uint32_t part[kLanes] = {}; ///< of the frame's row, or kWhole
    ObjectLight light[kLanes];
  };

  ObjectLight light_at(const ObjectHit& hit, bool back) const;
  void show(const ObjectLight& light, const Rgb& direct, const glm::ivec2& pixel, float coverage);
  void add_object(const ObjectHit& hit, int x, int y);
  void add_room(int x, int y, float coverage);
  void add_room_parts(int x, int y, std::span<const RoomPart> parts, float coverage);
  int add_room_point(const PixelSurface& at, const SamplingGrid::Interpolated& sky, std::uint32_t triangle, int x,
                     int y, float coverage);
  int add_point(Batch& batch, const PixelSurface& at, const SamplingGrid::Interpolated& sky, int x, int y,
                float coverage);
  void see_sky(Batch& batch, Layer layer);
  lanes::LightSums sum_sun(const Batch& batch, Layer layer, const SamplingGrid::SunCorners& corners);
  RayStarts spread_over_pixels(const Batch& batch, Layer layer, const PointBlock& starts);
  glm::vec3 start_of_sample(Layer layer, const glm::ivec2& pixel, std::size_t place, const glm::vec3& x,
                            const glm::vec3& n) const;
  bool spread_over_samples(const Batch& batch, Layer layer, int lane);
  void shade_objects(Batch& batch, const SamplingGrid::SunCorners& corners);
  void shade_room();
  void show_room(const DrawnPixel& light, const glm::ivec2& pixel, std::uint32_t part);
  void shade_pixels(const PixelBox& pixels, bool receives);
  bool shows_room_edge(const PixelBox& pixels) const;
  bool shows_shadow(const PixelBox& pixels) const;
  void shade_plain(const SamplingGrid::Corners& corners, const PixelBox& pixels);

  const SamplingGrid& grid_;
  const RayVisibility& visibility_;
  std::span<const std::uint8_t> receives_;
  const TracedScene& scene_;
  const VisibleSurfaces& view_;
  RenderedFrame& frame_;
  ShadowCasters casters_;
  Batch objects_, outlines_, room_; ///< outlines: points of objects that no grid point is valid for, of several blocks
  SamplingGrid::SunCorners sun_corners_; ///< of the block
  BlockedLights sun_blocked_;
  LightHints sun_hints_, sun_room_hints_;
  std::vector<PointBlock> sun_starts_; ///< of each light
  std::uint64_t rays_ = 0;
};

} // namespace daylit
