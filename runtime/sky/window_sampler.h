#pragma once

// Importance sampling of the sky restricted to the directions that reach the object (Grosch et al. 2007, sections 7
// and 7.1). Sample, density and inverse together.

#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "runtime/sky/sky_map.h"
#include "runtime/sky/window_cone.h"

namespace daylit {

struct WindowSample {
  glm::dvec3 direction{0.0}; ///< unit, towards the sky
  double pdf = 0.0;          ///< per steradian, > 0
  Rgb radiance{0.0f};        ///< of the texel it falls in
};

/// Density proportional to texel luminance x sqrt(visible fraction of the sphere), piecewise constant per texel in
/// solid angle, zero outside the window cone. The square root minimises the summed variance over the points of the
/// sphere, each of which sees only the fraction. No texel of zero luminance is ever returned.
class WindowSampler {
public:
  WindowSampler(const SkyMap& map, const WindowCone& cone);

  /// No light reaches the object through a window.
  bool empty() const { return total_ <= 0.0; }
  /// Maps u in [0, 1)^2 to a direction: u.y picks the row, u.x the texel in it. Undefined when empty().
  WindowSample sample_window(const glm::dvec2& u) const;
  /// Density of sample_window() at a unit direction, per steradian; 0 where it never samples.
  double window_pdf(const glm::dvec3& w) const;
  /// The u that sample_window() maps to the direction. Requires window_pdf(w) > 0.
  glm::dvec2 invert_window(const glm::dvec3& w) const;
  /// Texels with positive density.
  std::size_t texel_count() const { return texels_.size(); }

private:
  struct Texel {
    int column;
    double cumulative; ///< within the row, including this texel
  };
  struct Row {
    int row = 0;
    std::size_t first = 0, last = 0; ///< range in texels_
    double cumulative = 0.0;         ///< weight of the rows up to and including this one
    double weight = 0.0;
  };
  /// Rows of a band of tiles, their texels appended to `texels`.
  void append_band(const WindowCone& cone, int y0, int y1, std::vector<Row>& rows, std::vector<Texel>& texels) const;
  const Row* find_row(int row) const;
  const Texel* find_texel(const Row& row, int column) const;
  double texel_weight(const Row& row, const Texel& texel) const;

  const SkyMap* map_; ///< must outlive the sampler
  std::vector<Texel> texels_;
  std::vector<Row> rows_;
  double total_ = 0.0;
};

/// j-th of `count` points of a low-discrepancy set in [0, 1)^2: stratified in y, golden-ratio Kronecker in x.
glm::dvec2 lattice_point(int j, int count);

} // namespace daylit
