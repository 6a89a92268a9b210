#pragma once

// Which triangle the samples of every pixel show, drawn by the processor: where OpenGL is software, its way to each
// small triangle takes ten times as long.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "runtime/base/pixel_box.h"
#include "runtime/base/render_camera.h"

namespace daylit {

class TriangleRaster {
public:
  static constexpr int kSamples = 4; ///< of a pixel, where graphics cards have them

  struct Mesh {
    std::span<const glm::vec3> positions; ///< metres from `origin`
    std::span<const std::array<std::uint32_t, 3>> triangles;
    glm::dvec3 origin{0.0};
    bool numbered = true; ///< else it only hides what is behind
  };

  /// Empties the pixels of `box`, which may grow by a few columns.
  void start(const RenderCamera& camera, const PixelBox& box);
  /// Nearer triangles hide others; numbers start at 1. In parallel.
  void draw(const Mesh& mesh);
  /// One number per pixel for all of them: of the first sample that shows a triangle, negative where not all show it
  /// or lie further apart than `apart` times their depths, 1 / metres; 0: none.
  void find_shown(float apart);

  const PixelBox& box() const { return box_; } ///< columns: whole groups of four
  /// Row-major, kSamples per pixel; 0: nothing.
  const std::vector<float>& samples() const { return samples_; }
  const std::vector<float>& shown() const { return shown_; }
  /// 1 for each vertex of a triangle that a sample shows.
  std::vector<std::uint8_t> used_vertices(const Mesh& mesh) const;

private:
  struct Corner {
    double x = 0.0, y = 0.0; ///< pixels from the box's first
    double nearness = 0.0;   ///< 1 / depth, linear in the picture
  };
  struct Triangle {
    std::array<Corner, 3> corner;
    float number = 0.0f;
    int row0 = 0, row1 = 0, column0 = 0, column1 = 0; ///< half-open, within the box
  };
  RenderCamera camera_;
  PixelBox box_;
  std::vector<float> samples_, nearness_, shown_;
  std::vector<glm::dvec3> in_camera_;
  std::vector<Corner> corners_; ///< of the vertices beyond the near plane
  std::vector<Triangle> triangles_;
  std::vector<std::vector<std::uint32_t>> bands_; ///< of rows: triangles that touch them

  Corner project(const glm::dvec3& in_camera) const;
  void cut(const std::array<glm::dvec3, 3>& in_camera, float number);
  void draw_band(int band);
  void append(const std::array<Corner, 3>& corners, float number);
};

} // namespace daylit
