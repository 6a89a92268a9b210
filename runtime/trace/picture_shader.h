#pragma once

// Light on what the pixels show: visibility shared between neighbours first, then block by block.

#include <array>
#include <cstdint>
#include <vector>

#include "runtime/render/picture_renderer.h"
#include "runtime/trace/shadow_sums.h"
#include "runtime/trace/traced_renderer.h"
#include "runtime/trace/visible_surfaces.h"

namespace daylit {

struct LightGroup {
  LightGates lights;
  LightCone cone;
};

/// Everything that light meets, coordinates relative to `origin`.
struct TracedScene {
  TraceSettings settings;
  glm::dvec3 origin{0.0};
  PacketScene objects, occluders;
  OccluderReach occluder_reach;
  std::vector<glm::vec3> room_normals;      ///< unit, per triangle of the room's ray scene
  std::vector<std::uint32_t> room_triangle; ///< the same in Room::triangles
  std::vector<glm::vec3> positions, normals;
  std::vector<Rgb> reflectance;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<VertexLight> light;  ///< per vertex
  BoundingSphere sphere;           ///< around the objects, world
  glm::vec3 low{0.0f}, high{0.0f}; ///< box around their vertices
  LightGroup sky, sun;
  Rgb sun_normal_irradiance{0.0f};

  ShadowCasters casters() const {
    return {&objects, &occluders, glm::vec3(sphere.centre - origin), static_cast<float>(sphere.radius), low, high};
  }
};

/// Keeps its memory from frame to frame.
class PictureShader {
public:
  /// Fills the frame; returns how many shadow rays it took.
  std::uint64_t shade(const TracedScene& scene, const VisibleSurfaces& view, RenderedFrame& frame);

private:
  /// What the top left pixel of a block shows, and what the objects leave it of the sky.
  struct GridPoint {
    enum class Kind : std::uint8_t { none, object, room } kind = Kind::none;
    bool receives = false; ///< its share is to be found; else nothing is lost
    glm::vec3 normal{0.0f}, position{0.0f}, start{0.0f};
    Rgb before{1.0f}, after{1.0f}; ///< shares of the open sky received without and with the objects
  };
  PixelBox affected_box(const TracedScene& scene, const VisibleSurfaces& view);
  GridPoint grid_point(const TracedScene& scene, const VisibleSurfaces& view, int column, int row) const;
  std::uint64_t trace_grid(const TracedScene& scene, const VisibleSurfaces& view, const PixelBox& box);
  std::uint64_t trace_tile(const TracedScene& scene, const PixelBox& tile, GridPoint::Kind kind, int columns);

  friend class BlockShader;
  std::vector<std::uint8_t> receives_; ///< per block of the picture: some light may lose its way to it
  std::vector<GridPoint> grid_;        ///< per block of the picture
  std::vector<LightBits> sun_bits_;    ///< per block and group of lights
  std::size_t sun_groups_ = 0;
};

} // namespace daylit
