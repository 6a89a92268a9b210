#pragma once

// The texels of a radiance map in tiles: compact clusters on the sphere, whatever shape the map gives its texels; the
// cap of directions that holds one, and the Chebyshev points that stand for its texels where a lobe is smooth.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/maps/detail/lobe_kernels.h"
#include "runtime/maps/radiance_map.h"

namespace daylit::detail {

/// Directions w of a tile in a frame of its own: w = a e1 + b e2 + sqrt(1 - a^2 - b^2) centre, (a, b) in a box about
/// all texel centres. The frame has no fold, whatever the map has there.
struct TileFrame {
  glm::dvec3 centre, e1, e2;
  double radius = 0.0; ///< largest angle between the centre and a texel's centre, radians
  double low[2] = {0.0, 0.0}, half[2] = {0.0, 0.0};
  double box_radius = 0.0;               ///< largest angle between the centre and a point of the box
  std::array<std::uint32_t, 8> corner{}; ///< texels of the tile farthest along e1, e2, e1 + e2, ...
  double cos_radius = 1.0, sin_radius = 0.0, cos_box = 1.0, sin_box = 0.0; ///< of both

  glm::dvec3 direction(double a, double b) const;
};

/// Texels of a map in an order in which any aligned run of a power of two is compact: halved again and again at the
/// median of the coordinate with the largest extent (Bentley 1975, the k-d tree).
struct TexelOrder {
  std::vector<std::uint32_t> texel;
  std::vector<glm::dvec3> direction;

  explicit TexelOrder(const RadianceMap& map);
};

/// Runs of `texels` texels, a power of two of at least 16.
struct Tiles {
  const TexelOrder* order;
  std::size_t texels;
  std::vector<TileFrame> frames;

  Tiles(const TexelOrder& of, std::size_t texels_each);
  std::span<const glm::dvec3> directions(std::size_t tile) const { return {&order->direction[tile * texels], texels}; }
  std::span<const std::uint32_t> texels_of(std::size_t tile) const { return {&order->texel[tile * texels], texels}; }
  double largest_half() const;
  double mean_radius() const;
};

/// Chebyshev points of the first kind in [-1, 1] and their Lagrange basis (barycentric form; Berrut & Trefethen 2004).
struct Chebyshev {
  std::vector<double> node, weight;

  explicit Chebyshev(int order);
  /// basis[k] = l_k(x), node.size() values.
  void lagrange(double x, double* basis) const;
};

/// Interpolation in a tile between order x order Chebyshev points, as a matrix [texel][point]: the product of two
/// bases.
struct TileInterpolation {
  std::size_t order = 0;
  std::vector<double> along[2]; ///< [texel][order]

  TileInterpolation(const Tiles& tiles, std::size_t tile, const Chebyshev& points);
};
std::vector<glm::vec3> chebyshev_points(const TileFrame& tile, const Chebyshev& points);

/// Charges tile by tile, `per_tile` of them in each.
struct TiledCharges {
  Charges charges;
  std::size_t per_tile = 0;
};
TiledCharges texel_charges(const RadianceMap& map, const Tiles& tiles);
/// Sums of `group` texels each, at the mean of their directions.
TiledCharges group_charges(const RadianceMap& map, const Tiles& tiles, std::size_t group);
/// The same at the Chebyshev points: charges whose sum under any lobe that is a polynomial below `order` in either
/// coordinate of a tile is that of the texels (Fong & Darve 2009, "The black-box fast multipole method").
TiledCharges point_charges(const RadianceMap& map, const Tiles& tiles, const Chebyshev& chebyshev);

} // namespace daylit::detail
