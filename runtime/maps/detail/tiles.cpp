#include "runtime/maps/detail/tiles.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include "scene/core/parallel.h"

namespace daylit::detail {
namespace {

/// Angle between unit directions, accurate at both ends.
double angle_between(const glm::dvec3& a, const glm::dvec3& b) {
  return 2.0 * std::asin(std::min(1.0, 0.5 * glm::length(a - b)));
}

int longest_axis(std::span<const std::uint32_t> texels, std::span<const glm::dvec3> direction) {
  glm::dvec3 low(2.0), high(-2.0);
  for (const std::uint32_t t : texels) {
    low = glm::min(low, direction[t]);
    high = glm::max(high, direction[t]);
  }
  const glm::dvec3 extent = high - low;
  return extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
}

void halve(std::span<std::uint32_t> texels, std::span<const glm::dvec3> direction) {
  if (texels.size() <= 4)
    return;
  const int axis = longest_axis(texels, direction);
  const std::size_t middle = texels.size() / 2;
  std::nth_element(texels.begin(), texels.begin() + static_cast<std::ptrdiff_t>(middle), texels.end(),
                   [&](std::uint32_t a, std::uint32_t b) {
                     return direction[a][axis] != direction[b][axis] ? direction[a][axis] < direction[b][axis] : a < b;
                   });
  std::span<std::uint32_t> parts[2] = {texels.first(middle), texels.subspan(middle)};
  const auto halve_part = [&](int k) { halve(parts[k], direction); };
  if (texels.size() >= 16384)
    parallel_for(0, 2, halve_part);
  else
    for (int k = 0; k < 2; ++k)
      halve_part(k);
}

/// The longer axis of the tile: that of the texel farthest from the centre.
glm::dvec3 long_axis(std::span<const glm::dvec3> directions, const glm::dvec3& centre) {
  glm::dvec3 farthest = directions[0];
  for (const glm::dvec3& w : directions)
    if (glm::dot(w, centre) < glm::dot(farthest, centre))
      farthest = w;
  // a corner: the axes of a square are half a right angle away from it
  const glm::dvec3 diagonal = glm::normalize(farthest - glm::dot(farthest, centre) * centre);
  return (diagonal + glm::cross(centre, diagonal)) / std::numbers::sqrt2;
}

/// The texel farthest in each of eight directions of the frame.
std::array<std::uint32_t, 8> corners(std::span<const glm::dvec3> directions, const TileFrame& t) {
  std::array<std::uint32_t, 8> corner{};
  for (std::size_t k = 0; k < corner.size(); ++k) {
    const double angle = std::numbers::pi / 4.0 * static_cast<double>(k);
    const glm::dvec3 along = std::cos(angle) * t.e1 + std::sin(angle) * t.e2;
    for (std::size_t i = 1; i < directions.size(); ++i)
      if (glm::dot(directions[i], along) > glm::dot(directions[corner[k]], along))
        corner[k] = static_cast<std::uint32_t>(i);
  }
  return corner;
}

TileFrame frame_of(std::span<const glm::dvec3> directions) {
  TileFrame t;
  glm::dvec3 sum(0.0);
  for (const glm::dvec3& w : directions)
    sum += w;
  t.centre = glm::normalize(sum);
  t.e1 = long_axis(directions, t.centre);
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
  double square = 0.0;
  for (int k = 0; k < 2; ++k) {
    t.half[k] = 0.5 * (high[k] - t.low[k]);
    square += std::pow(std::max(std::abs(t.low[k]), std::abs(high[k])), 2);
  }
  t.box_radius = std::asin(std::min(1.0, std::sqrt(square)));
  t.corner = corners(directions, t);
  t.cos_radius = std::cos(t.radius);
  t.sin_radius = std::sin(t.radius);
  t.cos_box = std::cos(t.box_radius);
  t.sin_box = std::sin(t.box_radius);
  return t;
}

glm::dvec4 charge_of(const RadianceMap& map, std::uint32_t texel) { return {glm::dvec3(map.radiance[texel]), 1.0}; }

} // namespace

TexelOrder::TexelOrder(const RadianceMap& map) : texel(map.radiance.size()), direction(map.radiance.size()) {
  std::vector<glm::dvec3> by_texel(map.radiance.size());
  parallel_for(std::size_t(0), by_texel.size(), [&](std::size_t i) { by_texel[i] = map.direction(i); });
  std::iota(texel.begin(), texel.end(), 0u);
  halve(texel, by_texel);
  for (std::size_t i = 0; i < texel.size(); ++i)
    direction[i] = by_texel[texel[i]];
}

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

glm::dvec3 TileFrame::direction(double a, double b) const {
  return a * e1 + b * e2 + std::sqrt(std::max(0.0, 1.0 - a * a - b * b)) * centre;
}

Tiles::Tiles(const TexelOrder& of, std::size_t texels_each)
    : order(&of), texels(texels_each), frames(of.texel.size() / texels_each) {
  parallel_for(std::size_t(0), frames.size(), [&](std::size_t t) { frames[t] = frame_of(directions(t)); });
}

double Tiles::largest_half() const {
  double most = 0.0;
  for (const TileFrame& t : frames)
    most = std::max({most, t.half[0], t.half[1]});
  return most;
}

double Tiles::mean_radius() const {
  double sum = 0.0;
  for (const TileFrame& t : frames)
    sum += t.radius;
  return sum / static_cast<double>(frames.size());
}

TileInterpolation::TileInterpolation(const Tiles& tiles, std::size_t tile, const Chebyshev& points)
    : order(points.node.size()) {
  const TileFrame& frame = tiles.frames[tile];
  const auto directions = tiles.directions(tile);
  for (int k = 0; k < 2; ++k) {
    along[k].resize(directions.size() * order);
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const double at = glm::dot(directions[i], k == 0 ? frame.e1 : frame.e2);
      points.lagrange((at - frame.low[k]) / frame.half[k] - 1.0, &along[k][i * order]);
    }
  }
}

std::vector<glm::vec3> chebyshev_points(const TileFrame& tile, const Chebyshev& points) {
  std::vector<glm::vec3> directions;
  for (const double a : points.node)
    for (const double b : points.node)
      directions.emplace_back(
          tile.direction(tile.low[0] + tile.half[0] * (1.0 + a), tile.low[1] + tile.half[1] * (1.0 + b)));
  return directions;
}

TiledCharges texel_charges(const RadianceMap& map, const Tiles& tiles) { return group_charges(map, tiles, 1); }

TiledCharges group_charges(const RadianceMap& map, const Tiles& tiles, std::size_t group) {
  TiledCharges out;
  out.per_tile = tiles.texels / group;
  out.charges.resize(map.radiance.size() / group);
  parallel_for(tbb::blocked_range<std::size_t>(0, out.charges.size(), 1024), [&](const auto& range) {
    for (std::size_t k = range.begin(); k != range.end(); ++k) {
      glm::dvec3 direction(0.0);
      glm::dvec4 charge(0.0);
      for (std::size_t i = k * group; i < (k + 1) * group; ++i) {
        direction += tiles.order->direction[i];
        charge += charge_of(map, tiles.order->texel[i]);
      }
      out.charges.set(k, glm::normalize(direction), glm::dvec3(charge), charge.w);
    }
  });
  return out;
}

TiledCharges point_charges(const RadianceMap& map, const Tiles& tiles, const Chebyshev& chebyshev) {
  TiledCharges out;
  const std::size_t n = chebyshev.node.size();
  out.per_tile = (n * n + kChargePad - 1) / kChargePad * kChargePad;
  out.charges.resize(out.per_tile * tiles.frames.size());
  parallel_for(std::size_t(0), tiles.frames.size(), [&](std::size_t t) {
    const TileInterpolation to(tiles, t, chebyshev);
    std::vector<glm::dvec4> charge(out.per_tile, glm::dvec4(0.0));
    for (std::size_t i = 0; i < tiles.texels; ++i) {
      const glm::dvec4 value = charge_of(map, tiles.texels_of(t)[i]);
      for (std::size_t p = 0; p < n; ++p) {
        const glm::dvec4 along = to.along[0][i * n + p] * value;
        for (std::size_t q = 0; q < n; ++q)
          charge[p * n + q] += to.along[1][i * n + q] * along;
      }
    }
    const auto points = chebyshev_points(tiles.frames[t], chebyshev);
    for (std::size_t k = 0; k < out.per_tile; ++k)
      out.charges.set(t * out.per_tile + k, k < points.size() ? glm::dvec3(points[k]) : tiles.frames[t].centre,
                      glm::dvec3(charge[k]), charge[k].w);
  });
  return out;
}

} // namespace daylit::detail
