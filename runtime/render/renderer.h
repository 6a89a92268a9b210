#pragma once

// Draws the virtual objects and their new shadows on the phantom room. Radiance and irradiance only: what becomes of
// the photograph is decided in compose.h.

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "runtime/light/direct_light.h"
#include "runtime/render/gl_context.h"
#include "runtime/render/render_camera.h"
#include "scene/result.h"
#include "scene/room.h"

namespace daylit {

/// All virtual objects together, in the world.
struct ObjectSurface {
  std::vector<glm::dvec3> positions; ///< world metres
  std::vector<glm::vec3> normals;    ///< unit, world frame
  std::vector<Rgb> reflectance;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  BoundingSphere bounds() const; ///< of the vertices that triangles use; radius 0 when there are none
};

/// Of one object vertex, on the side of its normal (front) and on the other (the inside of a thin shell).
struct VertexLight {
  Rgb indirect_front{0.0f}, open_sky_front{0.0f}; ///< reflected indirect radiance; open_sky_irradiance()
  Rgb indirect_back{0.0f}, open_sky_back{0.0f};
};

struct RenderSettings {
  int sky_map_texels = 128; ///< shadow map side for sky samples
  int sun_map_texels = 256; ///< for samples of the sun, which carries most of the light in few samples
  int coverage_samples = 4; ///< per pixel, for object edges
};

/// One value per drawn pixel, row-major, top row first; averaged over the coverage samples of the pixel.
struct RenderedFrame {
  int width_px = 0, height_px = 0;
  std::vector<glm::vec4> object; ///< reflected radiance x coverage; w = coverage by visible virtual objects
  /// Shares of the room's direct light, each times w of `lost_sky` = share of the pixel that shows the room.
  std::vector<glm::vec4> lost_sky; ///< of the open sky irradiance, taken by the objects, per channel
  std::vector<glm::vec4> room;     ///< x: of the open sky, received without the objects; y, z: irradiance received
                                   ///< without the objects and taken by them, in normal irradiances of the sun
};

struct RenderTimes {
  double shadow_maps_ms = 0, picture_ms = 0, read_back_ms = 0;
};

/// Not thread-safe. After an Error the renderer is spent: make a new one.
class Renderer {
public:
  static Result<Renderer> make(std::unique_ptr<GlContext> context, const Room& room,
                               std::span<const Aperture> apertures, const RenderSettings& settings = {});
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;
  ~Renderer();

  Result<void> set_camera(const RenderCamera& camera);
  Result<void> set_objects(const ObjectSurface& objects);
  Result<void> set_vertex_light(std::span<const VertexLight> light);
  Result<void> set_lights(const LightSet& lights);
  Result<RenderedFrame> draw();

  const RenderTimes& times() const;
  std::string description() const; ///< back end, driver and version
  /// Triangles of the room that can stand between the object and the sky (the others lie on its convex outside).
  std::size_t room_occluders() const;

private:
  struct State;
  explicit Renderer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Indices of the room triangles that may block a ray from inside through an aperture. When every aperture lies in a
/// supporting plane of the room, a reflecting triangle in a supporting plane blocks none: a ray between two points of
/// the convex hull meets such a plane only at its end, and beyond the aperture there is nothing.
std::vector<std::uint32_t> occluding_triangles(const Room& room, std::span<const Aperture> apertures);

} // namespace daylit
