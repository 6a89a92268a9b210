#pragma once

// Shadow maps drawn by the processor: where OpenGL is software, its way to each of the many small triangles of 64 maps
// takes ten times as long.

#include <array>
#include <cstdint>
#include <span>

#include <glm/vec3.hpp>

namespace daylit {

/// Directions of a shadow map, unit; `toward` the light.
struct MapAxes {
  glm::vec3 right{1.0f, 0.0f, 0.0f}, up{0.0f, 1.0f, 0.0f}, toward{0.0f, 0.0f, 1.0f};
  bool operator==(const MapAxes&) const = default;
};

/// A mesh in parallel projection: the square of half width `half_width` (metres) around the origin becomes
/// `texels` x `texels` depths, 0 nearest to the light at +half_depth along it, kNothing where there is nothing. As
/// shaders/shadow_vertex.glsl: a texel holds the nearest surface at its centre.
struct DepthRaster {
  std::span<const glm::vec3> vertices; ///< metres
  std::span<const std::array<std::uint32_t, 3>> triangles;
  float half_width = 1.0f, half_depth = 1.0f;
  int texels = 0;
  static constexpr std::uint16_t kNothing = 0xFFFF;

  /// Whether a map may show anything of the mesh. Conservative.
  bool meets(const MapAxes& axes) const;
  /// `maps`: axes.size() times texels^2, row by row along `up`. In parallel.
  void draw(std::span<const MapAxes> axes, std::span<std::uint16_t> maps) const;
};

} // namespace daylit
