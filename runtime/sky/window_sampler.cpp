#include "runtime/sky/window_sampler.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <glm/geometric.hpp>

#include "scene/core/parallel.h"

namespace daylit {

namespace {

constexpr int kTile = 16; // texels on a side: most of the sphere is rejected per tile, by its bounding cone
constexpr double kOneBelow = 1.0 - 0x1p-53;

struct TileCone {
  glm::dvec3 axis;
  double half_angle;
};

/// Cone around the texels [x0, x1) x [y0, y1): its farthest points are corners or, near the equator, edge middles.
TileCone tile_cone(const SkyMap& map, int x0, int x1, int y0, int y1) {
  const glm::dvec3 axis = map.direction(0.5 * (x0 + x1), 0.5 * (y0 + y1));
  double cosine = 1.0;
  for (const double x : {1.0 * x0, 0.5 * (x0 + x1), 1.0 * x1})
    for (const double y : {1.0 * y0, 0.5 * (y0 + y1), 1.0 * y1})
      cosine = std::min(cosine, glm::dot(axis, map.direction(x, y)));
  return {axis, std::acos(std::clamp(cosine, -1.0, 1.0))};
}

} // namespace

/// Weight of a texel: luminance x sqrt(visible fraction) x solid angle. Tiles outside the clip planes are left out as a
/// whole, by their bounding cone.
void WindowSampler::append_band(const WindowCone& cone, int y0, int y1, std::vector<Row>& rows,
                                std::vector<Texel>& texels) const {
  const double texel_radius = 0.75 * std::numbers::pi / map_->height; // half a diagonal at the equator, rounded up
  std::vector<std::pair<int, glm::dvec2>> columns; // that some tile of the band allows, with their horizontal direction
  for (int x0 = 0; x0 < map_->width; x0 += kTile) {
    const int x1 = std::min(x0 + kTile, map_->width);
    const TileCone bound = tile_cone(*map_, x0, x1, y0, y1);
    for (int x = x0; x < x1 && cone.allows(bound.axis, bound.half_angle); ++x) {
      const double azimuth = 2.0 * std::numbers::pi * (0.5 - (x + 0.5) / map_->width);
      columns.emplace_back(x, glm::dvec2(std::cos(azimuth), std::sin(azimuth)));
    }
  }
  for (int y = y0; y < y1; ++y) {
    Row row{y, texels.size(), 0, 0.0, 0.0};
    const double theta = std::numbers::pi * (y + 0.5) / map_->height, s = std::sin(theta), z = std::cos(theta);
    const double texel_sr = map_->solid_angle_sr(y);
    for (const auto& [x, horizontal] : columns) {
      const double radiance = static_cast<double>(luminance(map_->at(x, y)));
      const glm::dvec3 w(s * horizontal.x, s * horizontal.y, z);
      if (!(radiance > 0.0) || !cone.allows(w, texel_radius))
        continue;
      // The floor keeps every allowed texel samplable although its centre may be seen by no point of the sphere.
      row.weight += radiance * std::sqrt(std::max(cone.visible_fraction(w), 0.01)) * texel_sr;
      texels.push_back({x, row.weight});
    }
    row.last = texels.size();
    if (row.weight > 0.0)
      rows.push_back(row);
  }
}

WindowSampler::WindowSampler(const SkyMap& map, const WindowCone& cone) : map_(&map) {
  if (cone.empty())
    return;
  struct Band {
    std::vector<Row> rows;
    std::vector<Texel> texels;
  };
  std::vector<Band> bands(static_cast<std::size_t>((map.height + kTile - 1) / kTile));
  parallel_for(std::size_t{0}, bands.size(), [&](std::size_t b) {
    const int y0 = static_cast<int>(b) * kTile;
    append_band(cone, y0, std::min(y0 + kTile, map.height), bands[b].rows, bands[b].texels);
  });
  for (const Band& band : bands) {
    for (Row row : band.rows) {
      row.first += texels_.size();
      row.last += texels_.size();
      total_ += row.weight;
      row.cumulative = total_;
      rows_.push_back(row);
    }
    texels_.insert(texels_.end(), band.texels.begin(), band.texels.end());
  }
}

/// Difference of the cumulative weights.
double WindowSampler::texel_weight(const Row& row, const Texel& texel) const {
  return texel.cumulative - (&texel == &texels_[row.first] ? 0.0 : (&texel - 1)->cumulative);
}

/// Inversion of the marginal density of rows, then of the density within the row (pbrt, 4th ed.: PiecewiseConstant2D).
/// Within a texel the direction is uniform in solid angle: cos theta is linear in the second number. pdf = weight /
/// (total Omega_texel), per steradian.
WindowSample WindowSampler::sample_window(const glm::dvec2& u) const {
  const double along_rows = std::clamp(u.y, 0.0, kOneBelow) * total_;
  auto row = std::upper_bound(rows_.begin(), rows_.end(), along_rows,
                              [](double value, const Row& r) { return value < r.cumulative; });
  if (row == rows_.end())
    --row;
  const double v = std::clamp((along_rows - (row->cumulative - row->weight)) / row->weight, 0.0, kOneBelow);

  const double along_texels = std::clamp(u.x, 0.0, kOneBelow) * row->weight;
  const auto first = texels_.begin() + static_cast<std::ptrdiff_t>(row->first);
  const auto last = texels_.begin() + static_cast<std::ptrdiff_t>(row->last);
  auto texel =
      std::upper_bound(first, last, along_texels, [](double value, const Texel& t) { return value < t.cumulative; });
  if (texel == last)
    --texel;
  const double weight = texel_weight(*row, *texel);
  const double h = std::clamp((along_texels - (texel->cumulative - weight)) / weight, 0.0, kOneBelow);

  const int y = row->row;
  const double pi = std::numbers::pi;
  const double upper = std::cos(pi * y / map_->height), lower = std::cos(pi * (y + 1) / map_->height);
  const double theta = std::acos(std::clamp(upper + v * (lower - upper), -1.0, 1.0)); // uniform in solid angle
  return {map_->direction(texel->column + h, theta / pi * map_->height), weight / (total_ * map_->solid_angle_sr(y)),
          map_->at(texel->column, y)};
}

const WindowSampler::Row* WindowSampler::find_row(int row) const {
  const auto it = std::lower_bound(rows_.begin(), rows_.end(), row, [](const Row& r, int y) { return r.row < y; });
  return it != rows_.end() && it->row == row ? &*it : nullptr;
}

const WindowSampler::Texel* WindowSampler::find_texel(const Row& row, int column) const {
  const auto first = texels_.begin() + static_cast<std::ptrdiff_t>(row.first);
  const auto last = texels_.begin() + static_cast<std::ptrdiff_t>(row.last);
  const auto it = std::lower_bound(first, last, column, [](const Texel& t, int x) { return t.column < x; });
  return it != last && it->column == column ? &*it : nullptr;
}

double WindowSampler::window_pdf(const glm::dvec3& w) const {
  const glm::dvec2 p = map_->position(w);
  const int y = std::min(static_cast<int>(p.y), map_->height - 1);
  const Row* row = find_row(y);
  const Texel* texel = row ? find_texel(*row, std::min(static_cast<int>(p.x), map_->width - 1)) : nullptr;
  return texel ? texel_weight(*row, *texel) / (total_ * map_->solid_angle_sr(y)) : 0.0;
}

/// The steps of sample_window() backwards.
glm::dvec2 WindowSampler::invert_window(const glm::dvec3& w) const {
  const glm::dvec2 p = map_->position(w);
  const int y = std::min(static_cast<int>(p.y), map_->height - 1), x = std::min(static_cast<int>(p.x), map_->width - 1);
  const Row* row = find_row(y);
  const Texel* texel = find_texel(*row, x);
  const double upper = std::cos(std::numbers::pi * y / map_->height),
               lower = std::cos(std::numbers::pi * (y + 1) / map_->height);
  const double v = (w.z - upper) / (lower - upper), weight = texel_weight(*row, *texel);
  return {(texel->cumulative - weight + (p.x - x) * weight) / row->weight,
          (row->cumulative - row->weight + v * row->weight) / total_};
}

/// x_j = frac((j + 1/2) phi^-1), y_j = (j + 1/2) / n: a Kronecker sequence with the golden ratio (Niederreiter 1992).
glm::dvec2 lattice_point(int j, int count) {
  const double x = (j + 0.5) * (std::numbers::phi - 1.0);
  return {x - std::floor(x), (j + 0.5) / count};
}

} // namespace daylit
