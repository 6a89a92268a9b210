#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "scene/core/parallel.h"
#include "scene/sky/quad_sums.h"
#include "scene/sky/sky_partition.h"

namespace daylit {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kSplitLevels = 4;  ///< a pixel that a border crosses is halved this many times, towards the border
constexpr int kRegionProbes = 8; ///< per side, to see whether a region reaches out of the field
constexpr std::int32_t kOutside = -1;

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

/// Shares of one pixel of a lens image among the regions. A square whose corners and centre lie in one region belongs
/// to it; any other is quartered, down to 1/16 pixel, and the last squares go by their centre. Squares outside the
/// field do not count.
class PixelSplitter {
public:
  using Shares = std::vector<std::pair<std::uint32_t, double>>;
  using Corners = std::array<std::int32_t, 4>; ///< regions at top left, top right, bottom left, bottom right

  PixelSplitter(const SkyGeometry& geometry, const SkyPartition& partition)
      : geometry_(geometry), partition_(partition) {}

  /// (region, share), shares sum to 1; empty when nothing of the pixel is in the field.
  const Shares& split(double x, double y, const Corners& corners) {
    shares_.clear();
    add_square(x, y, 0.5, corners, kSplitLevels);
    double total = 0;
    for (const auto& share : shares_)
      total += share.second;
    for (auto& share : shares_)
      share.second /= total;
    return shares_;
  }

  std::int32_t region_at(double x, double y) const {
    const std::optional<glm::dvec3> d = geometry_.direction({x, y});
    return d ? partition_.region_of(*d) : kOutside;
  }

private:
  void add_square(double x, double y, double half, const Corners& c, int levels) {
    const std::int32_t middle = region_at(x, y);
    if (c[0] == middle && c[1] == middle && c[2] == middle && c[3] == middle)
      return add_share(middle, 4 * half * half);
    const double q = 0.5 * half;
    if (levels == 1) {
      for (int k = 0; k < 4; ++k)
        add_share(region_at(x + (k % 2 ? q : -q), y + (k / 2 ? q : -q)), half * half);
      return;
    }
    const std::int32_t top = region_at(x, y - half), left = region_at(x - half, y), right = region_at(x + half, y),
                       bottom = region_at(x, y + half);
    add_square(x - q, y - q, q, {c[0], top, left, middle}, levels - 1);
    add_square(x + q, y - q, q, {top, c[1], middle, right}, levels - 1);
    add_square(x - q, y + q, q, {left, middle, c[2], bottom}, levels - 1);
    add_square(x + q, y + q, q, {middle, right, bottom, c[3]}, levels - 1);
  }

  void add_share(std::int32_t region, double area) {
    if (region == kOutside)
      return;
    for (auto& share : shares_)
      if (share.first == static_cast<std::uint32_t>(region)) {
        share.second += area;
        return;
      }
    shares_.emplace_back(static_cast<std::uint32_t>(region), area);
  }

  const SkyGeometry& geometry_;
  const SkyPartition& partition_;
  Shares shares_;
};

/// Nodes see smaller pixels by their centres.
double large_pixel_sr(const SkyPartition& nodes) {
  constexpr double kOfRegion = 1.0 / 64;
  return kOfRegion * 4 * kPi / nodes.size();
}

} // namespace

/// Pixels and cells are both rectangles in (azimuth, sin(altitude)), where area is solid angle: overlaps are exact.
std::vector<RegionSums::Share> RegionSums::equirect_shares(const SkyGeometry& geometry, const SkyPartition& partition) {
  const int width = geometry.width(), height = geometry.height();
  const double rotation = std::get<EquirectProjection>(geometry.projection()).rotation;
  std::vector<Share> runs;
  for (int y = 0; y < height; ++y) {
    const double top = std::cos(kPi * y / height), bottom = std::cos(kPi * (y + 1) / height);
    for (const SkyBand& band : partition.bands()) {
      double overlap = (std::min(top, band.sin_high) - std::max(bottom, band.sin_low)) / (top - bottom);
      if (overlap < 1e-12)
        continue;
      for (int cell = 0; cell < band.cells; ++cell) {
        // Column of an azimuth: (1/2 - (azimuth - rotation) / 2 pi) width; it falls as the azimuth grows.
        const double turn = (cell + (band.centred ? -0.5 : 0.0)) / band.cells;
        const double end = (0.5 - turn + rotation / (2 * kPi)) * width, begin = end - double(width) / band.cells;
        split_columns(begin, end, width, [&](std::uint32_t column, std::uint32_t count, double fraction) {
          runs.push_back({static_cast<std::uint32_t>(partition.region_of_cell(band.first_region + cell)),
                          static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(width) + column, count,
                          overlap * fraction});
        });
      }
    }
  }
  return runs;
}

std::vector<RegionSums::Share> RegionSums::lens_shares(const SkyGeometry& geometry, const SkyPartition& partition) {
  const std::size_t width = static_cast<std::size_t>(geometry.width());
  std::vector<std::vector<Share>> rows(static_cast<std::size_t>(geometry.height()));
  const std::size_t stride = width + 1;
  std::vector<std::int32_t> corner(stride * (rows.size() + 1));
  parallel_for(std::size_t{0}, rows.size() + 1, [&](std::size_t y) {
    const PixelSplitter splitter(geometry, partition);
    for (std::size_t x = 0; x < stride; ++x)
      corner[y * stride + x] = splitter.region_at(double(x) - 0.5, double(y) - 0.5);
  });
  parallel_for(std::size_t{0}, rows.size(), [&](std::size_t y) {
    PixelSplitter splitter(geometry, partition);
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t texel = y * width + x;
      if (geometry.solid_angle_sr()[texel] == 0)
        continue;
      const std::int32_t* top = &corner[y * stride + x];
      for (const auto& [region, share] :
           splitter.split(double(x), double(y), {top[0], top[1], top[stride], top[stride + 1]})) {
        Share* last = rows[y].empty() ? nullptr : &rows[y].back();
        if (share == 1.0 && last && last->region == region && last->weight == 1.0 && last->first + last->count == texel)
          ++last->count;
        else
          rows[y].push_back({region, static_cast<std::uint32_t>(texel), 1, share});
      }
    }
  });
  std::vector<Share> runs;
  for (const auto& row : rows)
    runs.insert(runs.end(), row.begin(), row.end());
  return runs;
}

/// Of pixels that are large beside a region: shares of the hats at 2 x 2 points. All others are in quads_.
std::vector<RegionSums::Share> RegionSums::node_shares(const SkyGeometry& geometry, const SkyPartition& partition) {
  const double large_sr = large_pixel_sr(partition);
  const auto width = static_cast<std::size_t>(geometry.width());
  std::vector<std::vector<Share>> rows(static_cast<std::size_t>(geometry.height()));
  parallel_for(std::size_t{0}, rows.size(), [&](std::size_t y) {
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t texel = y * width + x, first = rows[y].size();
      if (double(geometry.solid_angle_sr()[texel]) <= large_sr)
        continue;
      double total = 0;
      for (int k = 0; k < 4; ++k) {
        const auto d = geometry.direction({double(x) + (k % 2 ? 0.25 : -0.25), double(y) + (k / 2 ? 0.25 : -0.25)});
        if (!d)
          continue;
        total += 1;
        for (const RegionWeight& w : partition.interpolation(*d)) {
          const auto same = std::find_if(rows[y].begin() + static_cast<std::ptrdiff_t>(first), rows[y].end(),
                                         [&](const Share& r) { return r.region == std::uint32_t(w.region); });
          if (same != rows[y].end())
            same->weight += w.weight;
          else if (w.weight > 0)
            rows[y].push_back({std::uint32_t(w.region), static_cast<std::uint32_t>(texel), 1, w.weight});
        }
      }
      for (std::size_t i = first; i < rows[y].size(); ++i)
        rows[y][i].weight /= total;
    }
  });
  std::vector<Share> runs;
  for (const auto& row : rows)
    runs.insert(runs.end(), row.begin(), row.end());
  return runs;
}

/// Where the field ends, nodes take the fill for the part of their hat that no pixel covers.
void RegionSums::measure_nodes(const SkyPartition& partition) {
  constexpr double kRounding = 0.02; // of a hat: pixels are whole, hats are not
  for (std::size_t region = 0; region < covered_.size(); ++region) {
    const double hat_sr = partition.hat_sr(static_cast<int>(region)), missing = hat_sr - covered_[region];
    gap_[region] = geometry_->covers_sphere() || missing < kRounding * hat_sr ? 0.0 : missing;
  }
}

/// Of the spans as they are stored: the divisor of what reduce() sums.
void RegionSums::measure_coverage(const SkyPartition& partition) {
  const auto regions = static_cast<std::size_t>(partition.size());
  covered_.assign(regions, 0.0);
  gap_.assign(regions, 0.0);
  centre_.resize(regions);
  measure_sums(covered_);
  parallel_for(std::size_t{0}, regions, [&](std::size_t region) {
    centre_[region] = partition.centre(static_cast<int>(region));
    if (geometry_->covers_sphere() || partition.interpolated())
      return;
    // Only a region that really reaches out of the field has a gap; in the others the difference is the rounding of
    // the split pixels, and the fill must not leak in.
    bool open = false;
    for (int k = 0; k < kRegionProbes * kRegionProbes && !open; ++k)
      open = !geometry_->pixel(partition.sample(static_cast<int>(region), (k % kRegionProbes + 0.5) / kRegionProbes,
                                                (k / kRegionProbes + 0.5) / kRegionProbes));
    if (open)
      gap_[region] = std::max(0.0, partition.solid_angle_sr(static_cast<int>(region)) - covered_[region]);
  });
}

void RegionSums::set_divisors(const SkyPartition& partition) {
  divisor_.resize(covered_.size());
  for (std::size_t region = 0; region < covered_.size(); ++region) {
    const double total_sr =
        partition.interpolated() ? partition.solid_angle_sr(static_cast<int>(region)) : covered_[region] + gap_[region];
    if (total_sr <= 0) { // smaller than a sub-pixel
      unseen_.push_back(static_cast<std::uint32_t>(region));
      continue;
    }
    divisor_[region].per_sr = 1 / total_sr;
    const auto fill = static_cast<float>(gap_[region] / total_sr);
    (centre_[region].z < 0 ? divisor_[region].fill_below : divisor_[region].fill_above) = fill;
  }
}

RegionSums RegionSums::make(std::shared_ptr<const SkyGeometry> geometry, const SkyPartition& partition,
                            std::span<const std::uint8_t> needed) {
  RegionSums sums;
  sums.geometry_ = std::move(geometry);
  std::vector<Share> shares = partition.interpolated()        ? node_shares(*sums.geometry_, partition)
                              : sums.geometry_->is_equirect() ? equirect_shares(*sums.geometry_, partition)
                                                              : lens_shares(*sums.geometry_, partition);
  if (partition.interpolated())
    sums.quads_ = std::make_shared<const detail::QuadSums>(
        detail::QuadSums::make(*sums.geometry_, partition, large_pixel_sr(partition), needed));
  if (!needed.empty())
    std::erase_if(shares, [&](const Share& s) { return needed[s.region] == 0; });
  sums.make_spans(shares, static_cast<std::size_t>(partition.size()));
  sums.measure_coverage(partition);
  if (partition.interpolated())
    sums.measure_nodes(partition);
  sums.set_divisors(partition);
  sums.forget_all_but(needed);
  return sums;
}

/// Divisors of zero: what the pixels of others gave them does not count.
void RegionSums::forget_all_but(std::span<const std::uint8_t> needed) {
  if (needed.empty())
    return;
  for (std::size_t region = 0; region < divisor_.size(); ++region)
    if (needed[region] == 0)
      divisor_[region] = {};
  std::erase_if(unseen_, [&](std::uint32_t region) { return needed[region] == 0; });
}

std::vector<Rgb> region_radiance(const SkyImage& sky, const SkyPartition& partition) {
  return RegionSums::make(sky.geometry(), partition).reduce(sky);
}

} // namespace daylit
