#include "runtime/maps/detail/map_tiles.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include "scene/core/parallel.h"

namespace daylit::detail {
namespace {

/// Angle between unit directions, accurate at both ends.
double angle_between(const glm::dvec3& a, const glm::dvec3& b) {
  return 2.0 * std::asin(std::min(1.0, 0.5 * glm::length(a - b)));
}

TileFrame frame_of(std::span<const glm::dvec3> directions, std::size_t side) {
  TileFrame t;
  glm::dvec3 sum(0.0);
  for (const glm::dvec3& w : directions)
    sum += w;
  t.centre = glm::normalize(sum);
  const glm::dvec3 along = directions[side - 1] - directions[0];
  t.e1 = glm::normalize(along - glm::dot(along, t.centre) * t.centre);
  t.e2 = glm::cross(t.centre, t.e1);
  double high[2] = {-2.0, -2.0};
  t.low[0] = t.low[1] = 2.0;
  for (const glm::dvec3& w : directions) {
    t.radius = std::max(t.radius, angle_between(w, t.centre));
    const double at[2] = {glm::dot(w, t.e1), glm::dot(w, t.e2)};
    for (int k = 0; k < 2; ++k) {
      t.low[k] = std::min(t.low[k], at[k]);
      high[k] = std::max(high[k], at[k]);
    }
  }
  for (int k = 0; k < 2; ++k)
    t.half[k] = 0.5 * (high[k] - t.low[k]);
  return t;
}

} // namespace

Chebyshev::Chebyshev(int order) {
  for (int k = 0; k < order; ++k) {
    const double angle = std::numbers::pi * (k + 0.5) / order;
    node.push_back(std::cos(angle));
    weight.push_back(k % 2 == 0 ? std::sin(angle) : -std::sin(angle));
  }
}

void Chebyshev::lagrange(double x, double* basis) const {
  double sum = 0.0;
  for (std::size_t k = 0; k < node.size(); ++k) {
    if (x == node[k]) {
      std::fill_n(basis, node.size(), 0.0);
      basis[k] = 1.0;
      return;
    }
    sum += basis[k] = weight[k] / (x - node[k]);
  }
  for (std::size_t k = 0; k < node.size(); ++k)
    basis[k] /= sum;
}

int tile_side(int map_side) { return std::clamp(map_side / 32, 4, 16); }

double TileFrame::box_radius() const {
  double square = 0.0;
  for (int k = 0; k < 2; ++k)
    square += std::pow(std::max(std::abs(low[k]), std::abs(low[k] + 2.0 * half[k])), 2);
  return std::asin(std::min(1.0, std::sqrt(square)));
}

glm::dvec3 TileFrame::direction(double a, double b) const {
  return a * e1 + b * e2 + std::sqrt(std::max(0.0, 1.0 - a * a - b * b)) * centre;
}

MapTiles::MapTiles(int map_side_texels, int side_texels) : map_side(map_side_texels), side(side_texels) {
  const RadianceMap map(map_side);
  const std::size_t across = static_cast<std::size_t>(map_side / side);
  tiles.resize(across * across);
  directions.resize(map.radiance.size());
  parallel_for(std::size_t(0), tiles.size(), [&](std::size_t t) {
    for (std::size_t k = 0; k < texels(); ++k)
      directions[t * texels() + k] = map.direction(texel(t, k));
    tiles[t] = frame_of(directions_of(t), static_cast<std::size_t>(side));
  });
}

std::size_t MapTiles::texel(std::size_t tile, std::size_t k) const {
  const std::size_t n = static_cast<std::size_t>(side), across = static_cast<std::size_t>(map_side) / n;
  return (tile / across * n + k / n) * static_cast<std::size_t>(map_side) + tile % across * n + k % n;
}

double MapTiles::largest_half() const {
  double most = 0.0;
  for (const TileFrame& t : tiles)
    most = std::max({most, t.half[0], t.half[1]});
  return most;
}

TileInterpolation::TileInterpolation(const MapTiles& tiles, std::size_t tile, const Chebyshev& points)
    : order(points.node.size()) {
  const TileFrame& frame = tiles.tiles[tile];
  const auto directions = tiles.directions_of(tile);
  for (int k = 0; k < 2; ++k) {
    along[k].resize(directions.size() * order);
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const double at = glm::dot(directions[i], k == 0 ? frame.e1 : frame.e2);
      points.lagrange((at - frame.low[k]) / frame.half[k] - 1.0, &along[k][i * order]);
    }
  }
}

std::vector<glm::dvec3> chebyshev_points(const TileFrame& tile, const Chebyshev& points) {
  std::vector<glm::dvec3> directions;
  for (const double a : points.node)
    for (const double b : points.node)
      directions.push_back(
          tile.direction(tile.low[0] + tile.half[0] * (1.0 + a), tile.low[1] + tile.half[1] * (1.0 + b)));
  return directions;
}

TiledCharges texel_charges(const RadianceMap& map, const MapTiles& tiles) {
  TiledCharges out;
  out.per_tile = tiles.texels();
  out.charges.resize(map.radiance.size());
  out.sum.resize(tiles.tiles.size(), glm::dvec3(0.0));
  parallel_for(std::size_t(0), tiles.tiles.size(), [&](std::size_t t) {
    for (std::size_t k = 0; k < tiles.texels(); ++k) {
      const glm::dvec3 radiance(map.radiance[tiles.texel(t, k)]);
      out.charges.set(t * out.per_tile + k, tiles.directions_of(t)[k], radiance, 1.0);
      out.sum[t] += radiance;
    }
  });
  return out;
}

TiledCharges point_charges(const RadianceMap& map, const MapTiles& tiles, const Chebyshev& chebyshev) {
  TiledCharges out;
  const std::size_t n = chebyshev.node.size();
  out.per_tile = (n * n + kChargePad - 1) / kChargePad * kChargePad;
  out.charges.resize(out.per_tile * tiles.tiles.size());
  parallel_for(std::size_t(0), tiles.tiles.size(), [&](std::size_t t) {
    const TileInterpolation to(tiles, t, chebyshev);
    std::vector<glm::dvec4> charge(n * n, glm::dvec4(0.0));
    for (std::size_t i = 0; i < tiles.texels(); ++i) {
      const glm::dvec4 value(glm::dvec3(map.radiance[tiles.texel(t, i)]), 1.0);
      for (std::size_t p = 0; p < n; ++p)
        for (std::size_t q = 0; q < n; ++q)
          charge[p * n + q] += to.along[0][i * n + p] * to.along[1][i * n + q] * value;
    }
    const auto points = chebyshev_points(tiles.tiles[t], chebyshev);
    for (std::size_t k = 0; k < out.per_tile; ++k)
      if (k < points.size())
        out.charges.set(t * out.per_tile + k, points[k], glm::dvec3(charge[k]), charge[k].w);
      else
        out.charges.set(t * out.per_tile + k, tiles.tiles[t].centre, glm::dvec3(0.0), 0.0);
  });
  return out;
}

} // namespace daylit::detail
