#include "scene/sky/region_texels.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "scene/core/parallel.h"

namespace daylit::detail {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kSplitLevels = 4; ///< a pixel that a border crosses is halved this many times, towards the border
constexpr std::int32_t kOutside = -1;
constexpr std::uint32_t kMostRun = 128; ///< texels; sums of more in floats would err too much
constexpr std::size_t kStripRows = 32;  ///< whose weights are worked out at once

/// Nodes see smaller pixels by their centres.
double large_pixel_sr(const SkyPartition& nodes) {
  constexpr double kOfRegion = 1.0 / 64;
  return kOfRegion * 4 * kPi / nodes.size();
}

/// Texels [first, first + count) with the same part of each in a region.
struct Part {
  std::uint32_t region, first, count;
  float part;
};
using Parts = std::vector<Part>;

/// Whole columns and partial ones that an azimuth cell of an equirect image covers, positions in columns.
/// Calls add(first_column, count, fraction_of_each).
template <class Add>
void split_columns(double begin, double end, int width, const Add& add) {
  const auto emit = [&](long long first, long long count, double fraction) {
    while (count > 0) { // a cell may lie across the seam of the image
      const long long column = ((first % width) + width) % width;
      const long long run = std::min<long long>(count, width - column);
      add(static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(run), fraction);
      first += run;
      count -= run;
    }
  };
  // Borders that are meant to fall between columns do so only up to rounding.
  const auto snapped = [](double x) { return std::abs(x - std::round(x)) < 1e-9 ? std::round(x) : x; };
  begin = snapped(begin);
  end = snapped(end);
  const double first_whole = std::ceil(begin), last_whole = std::floor(end);
  if (first_whole > last_whole) {
    emit(static_cast<long long>(last_whole), 1, end - begin);
    return;
  }
  if (begin < first_whole)
    emit(static_cast<long long>(first_whole) - 1, 1, first_whole - begin);
  emit(static_cast<long long>(first_whole), static_cast<long long>(last_whole - first_whole), 1.0);
  if (end > last_whole)
    emit(static_cast<long long>(last_whole), 1, end - last_whole);
}

/// How one pixel of a lens image is divided among the regions. A square whose corners and centre lie in one region
/// belongs to it; any other is quartered, down to 1/16 pixel, and the last squares go by their centre. Squares outside
/// the field do not count.
class PixelSplitter {
public:
  using Fractions = std::vector<std::pair<std::uint32_t, double>>;
  using Corners = std::array<std::int32_t, 4>; ///< regions at top left, top right, bottom left, bottom right

  PixelSplitter(const SkyGeometry& geometry, const SkyPartition& partition)
      : geometry_(geometry), partition_(partition) {}

  /// (region, part of the pixel), parts sum to 1; empty when nothing of the pixel is in the field.
  const Fractions& split(double x, double y, const Corners& corners) {
    parts_.clear();
    add_square(x, y, 0.5, corners, kSplitLevels);
    double total = 0;
    for (const auto& part : parts_)
      total += part.second;
    for (auto& part : parts_)
      part.second /= total;
    return parts_;
  }

  std::int32_t region_at(double x, double y) const {
    const std::optional<glm::dvec3> d = geometry_.direction({x, y});
    return d ? partition_.region_of(*d) : kOutside;
  }

private:
  void add_square(double x, double y, double half, const Corners& c, int levels) {
    const std::int32_t middle = region_at(x, y);
    if (c[0] == middle && c[1] == middle && c[2] == middle && c[3] == middle)
      return add_part(middle, 4 * half * half);
    const double q = 0.5 * half;
    if (levels == 1) {
      for (int k = 0; k < 4; ++k)
        add_part(region_at(x + (k % 2 ? q : -q), y + (k / 2 ? q : -q)), half * half);
      return;
    }
    const std::int32_t top = region_at(x, y - half), left = region_at(x - half, y), right = region_at(x + half, y),
                       bottom = region_at(x, y + half);
    add_square(x - q, y - q, q, {c[0], top, left, middle}, levels - 1);
    add_square(x + q, y - q, q, {top, c[1], middle, right}, levels - 1);
    add_square(x - q, y + q, q, {left, middle, c[2], bottom}, levels - 1);
    add_square(x + q, y + q, q, {middle, right, bottom, c[3]}, levels - 1);
  }

  void add_part(std::int32_t region, double area) {
    if (region == kOutside)
      return;
    for (auto& part : parts_)
      if (part.first == static_cast<std::uint32_t>(region)) {
        part.second += area;
        return;
      }
    parts_.emplace_back(static_cast<std::uint32_t>(region), area);
  }

  const SkyGeometry& geometry_;
  const SkyPartition& partition_;
  Fractions parts_;
};

/// Pixels and cells are both rectangles in (azimuth, sin(altitude)), where area is solid angle: overlaps are exact.
Parts equirect_row(const SkyGeometry& geometry, const SkyPartition& partition, int y) {
  const int width = geometry.width(), height = geometry.height();
  const double rotation = std::get<EquirectProjection>(geometry.projection()).rotation;
  const double top = std::cos(kPi * y / height), bottom = std::cos(kPi * (y + 1) / height);
  Parts row;
  for (const SkyBand& band : partition.bands()) {
    const double overlap = (std::min(top, band.sin_high) - std::max(bottom, band.sin_low)) / (top - bottom);
    if (overlap < 1e-12)
      continue;
    for (int cell = 0; cell < band.cells; ++cell) {
      // Column of an azimuth: (1/2 - (azimuth - rotation) / 2 pi) width; it falls as the azimuth grows.
      const double turn = (cell + (band.centred ? -0.5 : 0.0)) / band.cells;
      const double end = (0.5 - turn + rotation / (2 * kPi)) * width, begin = end - double(width) / band.cells;
      split_columns(begin, end, width, [&](std::uint32_t column, std::uint32_t count, double fraction) {
        row.push_back({static_cast<std::uint32_t>(partition.region_of_cell(band.first_region + cell)),
                       static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(width) + column, count,
                       static_cast<float>(overlap * fraction)});
      });
    }
  }
  return row;
}

/// Partial pixels by subdivision, PixelSplitter; corners are shared by neighbouring pixels.
Parts lens_row(const SkyGeometry& geometry, const SkyPartition& partition, int y) {
  const auto width = static_cast<std::size_t>(geometry.width());
  PixelSplitter splitter(geometry, partition);
  const auto corners = [&](double at) {
    std::vector<std::int32_t> row(width + 1);
    for (std::size_t x = 0; x <= width; ++x)
      row[x] = splitter.region_at(double(x) - 0.5, at);
    return row;
  };
  const std::vector<std::int32_t> top = corners(y - 0.5), bottom = corners(y + 0.5);
  Parts row;
  for (std::size_t x = 0; x < width; ++x) {
    const std::size_t texel = static_cast<std::size_t>(y) * width + x;
    if (geometry.solid_angle_sr()[texel] == 0)
      continue;
    for (const auto& [region, part] : splitter.split(double(x), y, {top[x], top[x + 1], bottom[x], bottom[x + 1]}))
      row.push_back({region, static_cast<std::uint32_t>(texel), 1, static_cast<float>(part)});
  }
  return row;
}

/// The hat functions at the centre of a pixel; means over 2 x 2 points of pixels that are large beside a region.
Parts node_row(const SkyGeometry& geometry, const SkyPartition& nodes, int y) {
  const double large_sr = large_pixel_sr(nodes);
  const auto width = static_cast<std::size_t>(geometry.width());
  Parts row;
  for (std::size_t x = 0; x < width; ++x) {
    const std::size_t texel = static_cast<std::size_t>(y) * width + x, first = row.size();
    const auto sr = double(geometry.solid_angle_sr()[texel]);
    if (sr == 0)
      continue;
    const int points = sr > large_sr ? 4 : 1;
    std::array<double, 16> part{};
    double total = 0;
    for (int k = 0; k < points; ++k) {
      const double right = points == 1 ? 0.0 : k % 2 ? 0.25 : -0.25, down = points == 1 ? 0.0 : k / 2 ? 0.25 : -0.25;
      const auto d = geometry.direction({double(x) + right, double(y) + down});
      if (!d)
        continue;
      total += 1;
      for (const RegionWeight& w : nodes.interpolation(*d)) {
        std::size_t at = first;
        while (at < row.size() && row[at].region != static_cast<std::uint32_t>(w.region))
          ++at;
        if (at == row.size())
          row.push_back({static_cast<std::uint32_t>(w.region), static_cast<std::uint32_t>(texel), 1, 0.0f});
        part[at - first] += w.weight;
      }
    }
    for (std::size_t at = first; at < row.size(); ++at)
      row[at].part = static_cast<float>(part[at - first] / total);
  }
  return row;
}

} // namespace

void RegionTexels::add(std::uint32_t texel, float weight) {
  if (runs.empty() || runs.back().first + runs.back().count != texel || runs.back().count == kMostRun)
    runs.push_back({texel, 0});
  ++runs.back().count;
  weight_sr.push_back(weight);
}

/// weight = part of the pixel * its solid angle (of SkyGeometry, steradian). Strips of rows are worked out in parallel
/// and appended in order, so that a region's texels increase.
std::vector<RegionTexels> region_texels(const SkyGeometry& geometry, const SkyPartition& partition,
                                        std::span<const std::uint8_t> needed) {
  const auto row_of = partition.interpolated() ? node_row : geometry.is_equirect() ? equirect_row : lens_row;
  const std::vector<float>& solid_angle_sr = geometry.solid_angle_sr();
  const auto height = static_cast<std::size_t>(geometry.height());
  std::vector<RegionTexels> regions(static_cast<std::size_t>(partition.size()));
  for (std::size_t first = 0; first < height; first += kStripRows) {
    std::vector<Parts> rows(std::min(kStripRows, height - first));
    parallel_for(std::size_t{0}, rows.size(),
                 [&](std::size_t r) { rows[r] = row_of(geometry, partition, static_cast<int>(first + r)); });
    for (const Parts& row : rows)
      for (const Part& p : row)
        if ((needed.empty() || needed[p.region] != 0) && p.part > 0)
          for (std::uint32_t texel = p.first; texel < p.first + p.count; ++texel)
            regions[p.region].add(texel, p.part * solid_angle_sr[texel]);
  }
  return regions;
}

TexelMatrix::TexelMatrix(std::span<const RegionTexels> regions) {
  for (const RegionTexels& region : regions) {
    first_run.push_back(runs.size());
    first_weight.push_back(weight_sr.size());
    runs.insert(runs.end(), region.runs.begin(), region.runs.end());
    weight_sr.insert(weight_sr.end(), region.weight_sr.begin(), region.weight_sr.end());
  }
  first_run.push_back(runs.size());
  first_weight.push_back(weight_sr.size());
}

} // namespace daylit::detail
