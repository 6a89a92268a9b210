#pragma once

// What draws the virtual objects and their new shadows, whatever it draws with. Radiance and irradiance only: what
// becomes of the photograph is decided in compose.h.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "runtime/base/pixel_box.h"
#include "runtime/base/render_camera.h"
#include "runtime/object/object_surface.h"
#include "runtime/sky/direct_light.h"
#include "scene/core/result.h"
#include "scene/room/room.h"

namespace daylit {

/// The point of the room that a drawn pixel shows.
struct RoomSurface {
  std::uint32_t triangle = 0xFFFFFFFFu; ///< of the room; 0xFFFFFFFF: not known here
  glm::vec3 position{0.0f};             ///< relative to RenderedFrame::origin, metres
};

/// One value per drawn pixel of `box`, averaged over the coverage samples of the pixel. Pixels outside the box, and in
/// blocks where `shows` is 0, show neither an object nor a new shadow; values of such blocks are not defined, or not
/// even kept.
struct RenderedFrame {
  static constexpr int kBlock = 4; ///< pixels; the first block starts at pixel 0, wherever the box does
  int width_px = 0, height_px = 0;
  PixelBox box;
  std::vector<glm::vec4> object; ///< reflected radiance x coverage; w = coverage by visible virtual objects
  /// Fractions of the room's direct light, each times w of `lost_sky` = part of the pixel that shows the room.
  std::vector<glm::vec4> lost_sky;  ///< of the open sky irradiance, taken by the objects, per channel
  std::vector<glm::vec4> room;      ///< x: of the open sky, received without the objects; y, z: irradiance received
                                    ///< without the objects and taken by them, in normal irradiances of the sun
  std::vector<RoomSurface> surface; ///< empty, or where the room is seen; saves the composite a ray
  glm::dvec3 origin{0.0};
  std::vector<std::uint8_t> shows; ///< per block of the whole picture, row-major; empty: every block of the box shows
  /// Per block of the whole picture: its place among the blocks whose values are kept, sixteen one after another.
  /// Empty: the values are those of the box, row-major.
  std::vector<std::uint32_t> place;

  /// Of the values of a pixel that is shown.
  std::size_t index(int x, int y) const {
    if (place.empty())
      return static_cast<std::size_t>(y - box.y0) * box.width() + static_cast<std::size_t>(x - box.x0);
    return static_cast<std::size_t>(place[block_index(x, y)]) * kBlock * kBlock +
           static_cast<std::size_t>(y % kBlock * kBlock + x % kBlock);
  }
  std::size_t block_index(int x, int y) const {
    return static_cast<std::size_t>(y / kBlock) * ((width_px + kBlock - 1) / kBlock) + x / kBlock;
  }
  bool shown(int x, int y) const { return box.contains(x, y) && (shows.empty() || shows[block_index(x, y)] != 0); }
};

/// Not thread-safe. After an Error the renderer is spent: make a new one.
class PictureRenderer {
public:
  virtual ~PictureRenderer() = default;
  virtual Result<void> set_camera(const PinholeCamera& camera) = 0;
  virtual Result<void> set_objects(const ObjectSurface& objects) = 0;
  virtual Result<void> set_lights(const LightSet& lights) = 0;
  /// Per vertex: 1 where draw() will use its light. Call after set_camera() and set_objects().
  virtual Result<std::vector<std::uint8_t>> vertices_in_view() = 0;
  virtual Result<void> set_vertex_light(std::span<const VertexLight> light) = 0;
  /// Fills `frame`; giving the same one again saves its memory.
  virtual Result<void> draw(RenderedFrame& frame) = 0;

  /// What the room shows in a drawn pixel, objects or not; false where the renderer does not know. Call after draw().
  virtual bool room_point(int /*x*/, int /*y*/, RoomSurface& /*point*/) const { return false; }

  virtual std::uint64_t shadow_rays() const = 0; ///< traced by the last draw(); 0 with shadow maps
  virtual std::string description() const = 0;   ///< back end, driver and version
  /// Triangles of the room that can stand between the object and the sky (the others lie on its convex outside).
  virtual std::size_t room_occluders() const = 0;

protected:
  PictureRenderer() = default;
  PictureRenderer(const PictureRenderer&) = default;
  PictureRenderer(PictureRenderer&&) = default;
  PictureRenderer& operator=(const PictureRenderer&) = default;
  PictureRenderer& operator=(PictureRenderer&&) = default;
};

/// Indices of the room triangles that may block a ray from inside through an aperture. When every aperture lies in a
/// supporting plane of the room, a reflecting triangle in a supporting plane blocks none: a ray between two points of
/// the convex hull meets such a plane only at its end, and beyond the aperture there is nothing.
std::vector<std::uint32_t> occluding_triangles(const Room& room, std::span<const Aperture> apertures);

} // namespace daylit
