#pragma once

#include <array>
#include <vector>

#include "runtime/trace/picture_shader.h"

namespace daylit {

/// A point of an object and where its shadow rays start.
struct ObjectPoint {
  glm::vec3 position{0.0f}, normal{0.0f}, start{0.0f}; ///< normal: shading, on the side that is seen
  bool back = false;                                   ///< the inside of a thin shell
};
ObjectPoint object_point(const TracedScene& scene, const glm::vec3& eye, const ObjectHit& hit);

/// Shades blocks of pixels of one frame; one per thread.
class BlockShader {
public:
  BlockShader(const PictureShader& shared, const TracedScene& scene, const VisibleSurfaces& view, RenderedFrame& frame)
      : shared_(shared), scene_(scene), view_(view), frame_(frame), casters_(scene.casters()) {}
  void shade(int column, int row);
  std::uint64_t rays() const { return rays_; }

private:
  /// Points of one kind, up to a full set of lanes.
  struct Lanes {
    PointBlock points, starts;
    int count = 0;
    std::size_t pixel[kLanes] = {}; ///< in the frame
    float share[kLanes] = {};       ///< of the pixel
    std::uint32_t triangle[kLanes] = {};
    Rgb reflectance[kLanes] = {}, indirect[kLanes] = {}, open_sky[kLanes] = {};
  };
  using Corners = std::array<std::span<const LightBits>, 4>;

  void add_object(const ObjectHit& hit, std::size_t pixel);
  void add_room(int x, int y, float share, std::size_t pixel);
  void trace_representatives(const Lanes& lanes, PointOf point_of);
  void shade_objects();
  void shade_room();
  bool find_corners(int column, int row, PictureShader::GridPoint::Kind kind);
  std::span<const std::span<const LightBits>> corners(bool sun) const {
    const Corners& c = sun ? sun_corners_ : sky_corners_;
    return {c.data(), shared_by_corners_ ? c.size() : 0};
  }

  const PictureShader& shared_;
  const TracedScene& scene_;
  const VisibleSurfaces& view_;
  RenderedFrame& frame_;
  ShadowCasters casters_;
  Lanes objects_, room_;
  BlockedLights sky_blocked_, sun_blocked_;
  Corners sky_corners_, sun_corners_;
  bool shared_by_corners_ = false;
  std::vector<LightBits> own_bits_; ///< of the representatives of a block without corners
  std::uint64_t rays_ = 0;
};

} // namespace daylit
