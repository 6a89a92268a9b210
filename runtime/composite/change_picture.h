#pragma once

// The change of the room's indirect light in the photograph's pixels: looked up at the corners of blocks of pixels and
// interpolated where the corners lie on one side of one plane under the same sun. Elsewhere a pixel takes the change
// from the corners on its own plane, and the sun from them where they agree, else it is looked up.
//
// The change fades with distance and never ends. It is drawn as far as it can be seen: below kThreshold of the light
// before it, about half a code value of a bright sRGB pixel, it is brought to zero smoothly. What that leaves out is
// below two thirds of kThreshold, and reported.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "runtime/base/render_camera.h"
#include "runtime/indirect/indirect_shadow.h"
#include "runtime/picture/picture_renderer.h"
#include "scene/room/ray_scene.h"

namespace daylit {

/// At the room's point in a pixel: change of irradiance, and irradiance without objects, sun included.
struct PixelChange {
  Rgb irradiance{0.0f}, before{0.0f};
};

class ChangePicture {
public:
  static constexpr float kThreshold = 0.005f;
  /// Fraction of a change that is drawn, by its size relative to the light before it: 0 below half of kThreshold, 1
  /// above one and a half, smooth between.
  static float drawn_fraction(const Rgb& change, const Rgb& before);

  /// The room as the camera sees it; holds until the camera moves. `renderer`: may know what
  /// its pixels show of the room; else rays are cast.
  void set_view(const RenderCamera& camera, const RayScene& room_rays, const PictureRenderer* renderer,
                const glm::dvec3& origin);
  /// The field after its set_light(). `drawn`: where its objects cover all pixels around a corner nothing is looked up.
  void update(const IndirectShadow& field, const RenderedFrame* drawn = nullptr);

  /// Largest relative change that is not drawn, of the corners looked at.
  float left_out() const { return left_out_; }
  /// Empty where the room does not change visibly, or is not seen. Thread-safe.
  std::optional<PixelChange> at(int x, int y) const;
  /// What the room's radiance is multiplied with where nothing but this change happens; empty as at().
  std::optional<Rgb> ratio_at(int x, int y) const;

  static constexpr int kBlock = 8; ///< pixels
  /// Blocks without a visible change, between corners on one plane, and others.
  enum class Kind : std::uint8_t { nothing, interpolate, single };
  Kind kind_at(int x, int y) const { return kinds_[static_cast<std::size_t>(y / kBlock) * columns_ + x / kBlock]; }
  /// ratio_at() of the first `count` pixels of a row of an interpolated block.
  void interpolate_row(int x, int y, int count, Rgb* ratios) const;
  /// at() of the same; nothing is left out where at() is empty: then the change is zero.
  void interpolate_row(int x, int y, int count, PixelChange* changes) const;
  /// The room's triangles at the corners of a pixel's block where these lie on one side of one plane.
  std::optional<std::array<std::uint32_t, 4>> plane_of_block(int x, int y) const;

private:
  struct Corner {
    bool seen = false, affected = false;
    bool visible = false; ///< some of the change is drawn here
    std::uint32_t triangle = 0, facing = 0;
    glm::dvec3 position{0.0}, direction{0.0};
    IndirectChange change;
    Rgb sun{0.0f};
    float left_out = 0.0f; ///< of the change, relative to the light before
  };
  const RenderCamera* camera_ = nullptr;
  const RayScene* rays_ = nullptr;
  const PictureRenderer* renderer_ = nullptr;
  glm::dvec3 origin_{0.0}; ///< of the renderer's points
  const IndirectShadow* field_ = nullptr;
  int columns_ = 0, rows_ = 0; ///< of blocks; corners are one more each way
  std::vector<Corner> corners_;
  std::vector<Rgb> ratios_;          ///< at the corners
  std::vector<PixelChange> changes_; ///< the same
  std::vector<Kind> kinds_;
  std::vector<std::uint8_t> covered_; ///< per block: objects cover all of its pixels; empty: not known
  float left_out_ = 0.0f;

  Corner look(int x, int y) const;
  void light(Corner& corner) const;
  void weigh(std::size_t corner);
  void find_covered(const RenderedFrame* drawn);
  bool is_covered(std::size_t corner) const;
  static std::array<float, 4> corner_weights(int x, int y);
  std::array<const Corner*, 4> corners_around(int column, int row) const {
    return {&corner(column, row), &corner(column + 1, row), &corner(column, row + 1), &corner(column + 1, row + 1)};
  }
  std::optional<PixelChange> whole_at(int x, int y) const;
  std::optional<PixelChange> between_planes(int x, int y) const;
  Kind kind_of(int column, int row) const;
  const Corner& corner(int column, int row) const {
    return corners_[static_cast<std::size_t>(row) * (columns_ + 1) + column];
  }
};

} // namespace daylit
