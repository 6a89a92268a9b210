#pragma once

// Square tiles of a radiance map: the cap of directions that holds one, and the Chebyshev points that stand for its
// texels where a lobe is smooth.

#include <span>
#include <vector>

#include "runtime/maps/detail/lobe_kernels.h"
#include "runtime/maps/radiance_map.h"

namespace daylit::detail {

/// Texels along a tile of a map: 4 to 16, and at most 32 x 32 tiles where that allows it.
int tile_side(int map_side);

/// Directions w of a tile in a frame of its own: w = a e1 + b e2 + sqrt(1 - a^2 - b^2) centre, (a, b) in a box about
/// all texel centres. The frame has no fold, whatever the map has there.
struct TileFrame {
  glm::dvec3 centre, e1, e2;
  double radius = 0.0; ///< largest angle between the centre and a texel's centre, radians
  double low[2] = {0.0, 0.0}, half[2] = {0.0, 0.0};

  double box_radius() const; ///< largest angle between the centre and a point of the box
  glm::dvec3 direction(double a, double b) const;
};

/// The tiles of a map, row by row, and the directions of their texels, tile by tile.
struct MapTiles {
  int map_side = 0, side = 0; ///< texels
  std::vector<TileFrame> tiles;
  std::vector<glm::dvec3> directions;

  explicit MapTiles(int map_side_texels) : MapTiles(map_side_texels, tile_side(map_side_texels)) {}
  MapTiles(int map_side_texels, int side_texels);
  std::size_t texels() const { return static_cast<std::size_t>(side) * side; } ///< of one tile
  std::size_t texel(std::size_t tile, std::size_t k) const;                    ///< of the map; k: of the tile
  std::span<const glm::dvec3> directions_of(std::size_t tile) const { return {&directions[tile * texels()], texels()}; }
  double largest_half() const;
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

  TileInterpolation(const MapTiles& tiles, std::size_t tile, const Chebyshev& points);
};
std::vector<glm::dvec3> chebyshev_points(const TileFrame& tile, const Chebyshev& points);

/// Charges of the texels of a map, tile by tile; per tile the sum of its radiance.
struct TiledCharges {
  Charges charges;
  std::size_t per_tile = 0;
  std::vector<glm::dvec3> sum;
};
TiledCharges texel_charges(const RadianceMap& map, const MapTiles& tiles);
/// The same at the Chebyshev points: charges whose sum under any lobe that is a polynomial below `order` in either
/// coordinate of a tile is that of the texels (Fong & Darve 2009, "The black-box fast multipole method").
TiledCharges point_charges(const RadianceMap& map, const MapTiles& tiles, const Chebyshev& chebyshev);

} // namespace daylit::detail
