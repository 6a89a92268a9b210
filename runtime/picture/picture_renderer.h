#pragma once

// What draws the virtual objects and their new shadows, whatever it draws with. Radiance and irradiance only: what
// becomes of the photograph is decided in compose.h.

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "runtime/base/pixel_box.h"
#include "runtime/base/render_camera.h"
#include "runtime/object/object_surface.h"
#include "runtime/sky/direct_light.h"
#include "scene/core/result.h"
#include "scene/room/room.h"

namespace daylit {

constexpr std::uint32_t kUnknownTriangle = 0xFFFFFFFFu;

/// The point of the room that a drawn pixel shows.
struct RoomSurface {
  std::uint32_t triangle = kUnknownTriangle; ///< of the room
  glm::dvec3 position{0.0};                  ///< world metres
};

constexpr std::size_t kMostRoomParts = 3; ///< of a pixel
/// One surface of the room of several in a pixel, and its part of the pixel.
struct RoomSurfacePart {
  RoomSurface surface;
  float fraction = 0.0f;
};

/// What a renderer draws at a pixel, averaged over its coverage samples.
struct DrawnPixel {
  glm::vec4 object{0.0f}; ///< reflected radiance x coverage; w = coverage by visible virtual objects
  /// Fractions of the room's direct light, each times w of `lost_sky` = part of the pixel that shows the room.
  glm::vec4 lost_sky{0.0f}; ///< of the open sky irradiance, taken by the objects, per channel
  glm::vec2 received{0.0f}; ///< without the objects, x: of the open sky; y: of the sun, in its normal irradiances
  Rgb lost_sun{0.0f};       ///< of that, taken by the objects, per channel
  std::uint32_t triangle = kUnknownTriangle; ///< of the room, where it is seen: saves a ray
};

/// One surface of the room of several in a pixel, whose fractions are then the sums of theirs.
struct DrawnPart {
  int x = 0, y = 0;         ///< of the pixel
  glm::dvec3 position{0.0}; ///< of its point, world metres
  DrawnPixel light;         ///< w of `lost_sky` is its part of the pixel, objects or not
  float shown = 0.0f;       ///< its part of the pixel that no object covers
};

/// Values are kept of the blocks that show an object or a new shadow, in rows of blocks: a large picture shows few.
/// Different rows may be filled by different threads.
struct RenderedFrame {
  static constexpr int kBlock = 4; ///< pixels on a side
  int width_px = 0, height_px = 0;
  PixelBox box; ///< nothing is shown outside it

  /// Nothing is shown yet; memory is kept.
  void start(int width, int height, const PixelBox& shown_box) {
    width_px = width;
    height_px = height;
    box = shown_box;
    place_.assign(static_cast<std::size_t>(columns()) * rows(), kNotShown);
    first_part_.assign(place_.size(), kNotShown);
    pixels_.resize(static_cast<std::size_t>(rows()));
    parts_.resize(static_cast<std::size_t>(rows()));
    for (auto& row : pixels_)
      row.clear();
    for (auto& row : parts_)
      row.clear();
  }
  /// The row will show so many blocks at most. Memory counts only where it is written.
  void expect(int row, std::size_t blocks) { pixels_[static_cast<std::size_t>(row)].reserve(blocks * kPixels); }
  /// Sixteen pixels, row by row; valid until the next show() in the row.
  std::span<DrawnPixel> show(int column, int row) {
    auto& pixels = pixels_[static_cast<std::size_t>(row)];
    place_[block(column, row)] = static_cast<std::uint32_t>(pixels.size());
    pixels.resize(pixels.size() + kPixels);
    return {&pixels[pixels.size() - kPixels], kPixels};
  }
  /// Takes back the last show() of the row.
  void take_back(int column, int row) {
    auto& pixels = pixels_[static_cast<std::size_t>(row)];
    pixels.resize(pixels.size() - kPixels);
    place_[block(column, row)] = first_part_[block(column, row)] = kNotShown;
  }

  bool shows(int column, int row) const { return place_[block(column, row)] != kNotShown; }
  bool shown(int x, int y) const { return box.contains(x, y) && shows(x / kBlock, y / kBlock); }
  /// Of a pixel that is shown.
  const DrawnPixel& at(int x, int y) const {
    return pixels_[static_cast<std::size_t>(y / kBlock)][place_[block(x / kBlock, y / kBlock)] + in_block(x, y)];
  }
  DrawnPixel& at(int x, int y) { return const_cast<DrawnPixel&>(std::as_const(*this).at(x, y)); }
  /// Of a pixel that is shown: empty where it shows one surface of the room at most.
  std::span<const DrawnPart> parts(int x, int y) const {
    if (!has_parts(x / kBlock, y / kBlock))
      return {};
    const std::span row(parts_[static_cast<std::size_t>(y / kBlock)]);
    const auto block_parts = row.subspan(first_part_[block(x / kBlock, y / kBlock)]);
    const auto of_pixel = [&](const DrawnPart& part) { return part.x == x && part.y == y; };
    const auto of_block = [&](const DrawnPart& part) { return part.x / kBlock == x / kBlock; };
    const auto first = std::find_if(block_parts.begin(), std::ranges::find_if_not(block_parts, of_block), of_pixel);
    return {first, std::find_if_not(first, block_parts.end(), of_pixel)};
  }
  /// A block that is shown has a pixel with several surfaces of the room.
  bool has_parts(int column, int row) const { return first_part_[block(column, row)] != kNotShown; }
  /// For a pixel of the block last shown in the row that has none; valid until the next in the row of blocks.
  std::span<DrawnPart> add_parts(int x, int y, std::size_t count) {
    auto& row = parts_[static_cast<std::size_t>(y / kBlock)];
    if (!has_parts(x / kBlock, y / kBlock))
      first_part_[block(x / kBlock, y / kBlock)] = static_cast<std::uint32_t>(row.size());
    DrawnPart part;
    part.x = x;
    part.y = y;
    row.resize(row.size() + count, part);
    return std::span(row).last(count);
  }
  std::uint32_t part_count(int y) const {
    return static_cast<std::uint32_t>(parts_[static_cast<std::size_t>(y / kBlock)].size());
  }
  /// By its place in the row of blocks.
  DrawnPart& part(int y, std::uint32_t index) { return parts_[static_cast<std::size_t>(y / kBlock)][index]; }
  int columns() const { return (width_px + kBlock - 1) / kBlock; }
  int rows() const { return (height_px + kBlock - 1) / kBlock; }

private:
  static constexpr std::size_t kPixels = kBlock * kBlock;
  static constexpr std::uint32_t kNotShown = 0xFFFFFFFFu;
  std::size_t block(int column, int row) const { return static_cast<std::size_t>(row) * columns() + column; }
  static std::size_t in_block(int x, int y) { return static_cast<std::size_t>(y % kBlock * kBlock + x % kBlock); }
  std::vector<std::vector<DrawnPixel>> pixels_; ///< per row of blocks: sixteen of each that is shown
  std::vector<std::vector<DrawnPart>> parts_;   ///< per row of blocks
  std::vector<std::uint32_t> place_;            ///< per block: its first pixel in the row
  std::vector<std::uint32_t> first_part_;       ///< per block: in the row of blocks
};

/// Not thread-safe. After an Error the renderer is spent: make a new one.
class PictureRenderer {
public:
  virtual ~PictureRenderer() = default;
  virtual Result<void> set_camera(const PinholeCamera& camera) = 0;
  virtual Result<void> set_objects(const ObjectSurface& objects) = 0;
  virtual Result<void> set_lights(const LightSet& lights) = 0;
  /// Those whose light draw() will use, ascending. Call after set_camera() and set_objects().
  virtual Result<std::vector<std::uint32_t>> vertices_in_view() = 0;
  /// `light`: of each of the ascending `vertices`; the others are not drawn until they have some.
  virtual Result<void> set_vertex_light(std::span<const std::uint32_t> vertices,
                                        std::span<const VertexLight> light) = 0;
  /// Fills `frame`; giving the same one again saves its memory.
  virtual Result<void> draw(RenderedFrame& frame) = 0;

  /// What the room shows in a drawn pixel, objects or not; false where the renderer does not know. Call after draw().
  virtual bool room_point(int /*x*/, int /*y*/, RoomSurface& /*point*/) const { return false; }

  /// Where a drawn pixel shows several surfaces of the room, objects or not: writes them and returns how many they are;
  /// 0 elsewhere, and where the renderer does not know. Call after draw().
  virtual std::size_t room_parts(int /*x*/, int /*y*/, std::span<RoomSurfacePart, kMostRoomParts> /*parts*/) const {
    return 0;
  }

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

/// Error value_invalid: not one light for each vertex, or a vertex that is not there.
Result<void> check_vertex_light(std::span<const std::uint32_t> vertices, std::size_t lights, std::size_t vertex_count);
/// 0 to count - 1.
std::vector<std::uint32_t> every_vertex(std::size_t count);

/// Indices of the room triangles that may block a ray from inside through an aperture. When every aperture lies in a
/// supporting plane of the room, a reflecting triangle in a supporting plane blocks none: a ray between two points of
/// the convex hull meets such a plane only at its end, and beyond the aperture there is nothing.
std::vector<std::uint32_t> occluding_triangles(const Room& room, std::span<const Aperture> apertures);

} // namespace daylit
