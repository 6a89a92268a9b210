#pragma once

// The change of the room's indirect light in the photograph's pixels: looked up at the corners of blocks of pixels and
// interpolated where the corners lie on one side of one plane under the same sun. Elsewhere a pixel takes the change
// from the corners on its own plane, and the sun from them where they agree, else it is looked up.
//
// The change fades with distance and never ends. It is drawn as far as it can be seen: below kThreshold of the light
// before it, about half a code value of a bright sRGB pixel, it is brought to zero smoothly. What is not drawn is
// below two thirds of kThreshold, and reported.

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include "runtime/base/render_camera.h"
#include "runtime/indirect/indirect_shadow.h"
#include "runtime/picture/picture_renderer.h"
#include "scene/image/rgb_image.h"
#include "scene/room/ray_scene.h"

namespace daylit {

/// Less of a pixel than this shows no object: half a code value of 255.
constexpr float kLeastCoverage = 1.0f / 510.0f;

/// |after - before| > threshold max(|before|, |after|) in some channel.
inline bool exceeds(const Rgb& before, const Rgb& after, float threshold) {
  const glm::bvec3 differs =
      glm::greaterThan(glm::abs(after - before), threshold * glm::max(glm::abs(before), glm::abs(after)));
  return differs.x | differs.y | differs.z; // no branch: it would be guessed wrong at every faint edge
}

/// 1 + change / before, not below zero; 1 where there was no light.
inline Rgb light_ratio(const Rgb& change, const Rgb& before) {
  Rgb ratio(1.0f);
  for (int c = 0; c < 3; ++c)
    if (before[c] > 0.0f)
      ratio[c] = std::max(1.0f + change[c] / before[c], 0.0f);
  return ratio;
}

/// The point of the room in a pixel.
struct ViewPoint {
  bool seen = false; ///< false: the pixel shows no surface
  std::uint32_t triangle = 0;
  glm::dvec3 position{0.0}, direction{0.0}; ///< world; of the ray from the camera
};

/// The room as a camera sees it at the corners of blocks of pixels: what light that changes slowly is looked up for.
/// Pixels are the photograph's. Keeps references to everything given.
class ViewCorners {
public:
  static constexpr int kBlock = 8; ///< pixels on a side of a block

  ViewCorners() = default;
  /// `renderer`: may know what its pixels show of the room; else rays are cast. May be null.
  ViewCorners(const RenderCamera& camera, const RayScene& room_rays, const PictureRenderer* renderer);

  /// Through any pixel.
  ViewPoint look(int x, int y) const;
  /// The surfaces of the room, where a pixel shows several: of the drawn pixel nearest to the photograph's.
  struct Part {
    ViewPoint point;
    float fraction = 0.0f; ///< of the pixel
  };
  std::vector<Part> parts(int x, int y) const;
  int columns() const { return columns_; } ///< of blocks; corners are one more each way
  int rows() const { return rows_; }
  std::size_t index(int column, int row) const { return static_cast<std::size_t>(row) * (columns_ + 1) + column; }
  /// By index.
  const std::vector<ViewPoint>& corners() const { return corners_; }
  bool distorted() const { return !camera_->drawn_position.empty(); }

private:
  const RenderCamera* camera_ = nullptr;
  const RayScene* rays_ = nullptr;
  const PictureRenderer* renderer_ = nullptr;
  int columns_ = 0, rows_ = 0;
  std::vector<ViewPoint> corners_;
};

/// At the room's point in a pixel: change of irradiance, and irradiance without objects, sun included.
struct PixelChange {
  Rgb irradiance{0.0f}, before{0.0f};
};

class ChangePicture {
public:
  static constexpr float kThreshold = 0.005f;
  static constexpr int kBlock = ViewCorners::kBlock;
  /// Fraction of a change that is drawn, by its size relative to the light before it: 0 below half of kThreshold, 1
  /// above one and a half, smooth between.
  static float drawn_fraction(const Rgb& change, const Rgb& before);

  /// `view` and `field`, after its set_light(), must live until the next call. `drawn`: where its objects cover all
  /// pixels around a corner nothing is looked up; may be null.
  void update(const ViewCorners& view, const IndirectShadow& field, const RenderedFrame* drawn);

  /// Largest relative change that is not drawn, of the corners looked at.
  float left_out() const { return left_out_; }
  /// Empty where the room does not change visibly, or is not seen. Thread-safe.
  std::optional<PixelChange> at(int x, int y) const;
  /// The same at one of several surfaces that the pixel shows.
  std::optional<PixelChange> at(int x, int y, const ViewPoint& point) const;
  /// Irradiance without objects, sun included, also where nothing changes.
  Rgb light_before(const ViewPoint& point) const;
  const ViewCorners& view() const { return *view_; }
  /// What the room's radiance is multiplied with where nothing but this change happens; empty as at().
  std::optional<Rgb> ratio_at(int x, int y) const;

  /// Blocks without a visible change, between corners on one plane, beside an object, and others.
  enum class Kind : std::uint8_t { nothing, interpolate, contact, single };
  Kind kind_at(int x, int y) const {
    return kinds_[static_cast<std::size_t>(y / kBlock) * view_->columns() + x / kBlock];
  }
  /// ratio_at() of the first `count` pixels of a row of an interpolated block.
  void interpolate_row(int x, int y, int count, Rgb* ratios) const;
  /// at() of the same; nothing is left out where at() is empty: then the change is zero.
  void interpolate_row(int x, int y, int count, PixelChange* changes) const;
  /// The room's triangles at the corners of a pixel's block where these lie on one side of one plane.
  std::optional<std::array<std::uint32_t, 4>> plane_of_block(int x, int y) const;

private:
  /// Of a point that an object affects: `affected`; that shows some of the change: `visible`.
  struct Light {
    bool affected = false, visible = false;
    std::uint32_t facing = 0;
    IndirectChange change;
    Rgb sun{0.0f};
    double surface_distance_m = 0.0; ///< to an object
    float left_out = 0.0f;           ///< of the change, relative to the light before
  };
  Light light_at(const ViewPoint& point) const;
  std::vector<std::uint8_t> hidden_blocks(const RenderedFrame* drawn) const;
  bool is_hidden(int column, int row, const std::vector<std::uint8_t>& blocks) const;
  void set_corner(std::size_t corner, const Light& light);
  Kind kind_of(int column, int row) const;
  std::array<std::size_t, 4> corners_of(int column, int row) const {
    const std::size_t first = view_->index(column, row), below = view_->index(column, row + 1);
    return {first, first + 1, below, below + 1};
  }
  std::optional<PixelChange> whole_at(int x, int y) const;
  std::optional<PixelChange> between_planes(int x, int y, Kind kind, const ViewPoint& point) const;
  bool touches_object(const std::array<std::size_t, 4>& corners) const;

  const ViewCorners* view_ = nullptr;
  const IndirectShadow* field_ = nullptr;
  // Per corner:
  std::vector<Light> lights_;
  std::vector<Rgb> ratios_;
  std::vector<PixelChange> changes_;
  std::vector<Kind> kinds_; ///< per block
  float left_out_ = 0.0f;
};

} // namespace daylit
