#include "scene/sky/sky_partition.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "scene/core/text_lines.h"

namespace daylit {

namespace {

constexpr double kPi = std::numbers::pi, kTwoPi = 2 * kPi;
constexpr int kMaxRegions = 100000;
constexpr std::array<int, 7> kTregenzaCells{30, 30, 24, 24, 18, 12, 6};

/// One band above the horizon, before mirroring.
struct UpperBand {
  double sin_low, sin_high;
  int cells;
};

/// Bands from nadir to zenith: the mirror image, then the upper half. Numbering follows.
std::vector<SkyBand> mirrored(const std::vector<UpperBand>& upper, bool centred) {
  std::vector<SkyBand> bands;
  for (auto b = upper.rbegin(); b != upper.rend(); ++b)
    bands.push_back({-b->sin_high, -b->sin_low, b->cells, 0, centred});
  for (const UpperBand& b : upper)
    bands.push_back({b.sin_low, b.sin_high, b.cells, 0, centred});
  int next = 0;
  for (SkyBand& band : bands) {
    band.first_region = next;
    next += band.cells;
  }
  return bands;
}

/// Reinhart & Walkenhorst 2001, as Radiance's MF:k subdivision: rows of 90/(7k + 1/2) degrees, k times the cells of
/// Tregenza's row, and an undivided cap of half a row. One cell of each row is centred on north (+y) as there: rows of
/// 4 n cells then have one centred on +x as well, rows of 4 n + 2 have a border there.
std::vector<SkyBand> reinhart_bands(int k) {
  const double row = 0.5 * kPi / (7 * k + 0.5);
  std::vector<UpperBand> upper;
  for (int i = 0; i < 7 * k; ++i)
    upper.push_back({std::sin(row * i), std::sin(row * (i + 1)), k * kTregenzaCells[static_cast<std::size_t>(i / k)]});
  upper.push_back({upper.back().sin_high, 1.0, 1});
  std::vector<SkyBand> bands = mirrored(upper, true);
  for (SkyBand& band : bands)
    band.centred = band.cells == 1 || band.cells % 4 == 0;
  return bands;
}

/// n equal cells above the horizon: a cap of one cell, then collars of about equal height whose borders are moved so
/// that each holds a whole number of cells (the recursive zonal construction of Leopardi 2006, on a hemisphere).
std::vector<UpperBand> equal_area_hemisphere(int n) {
  if (n < 4)
    return {{0.0, 1.0, n}};
  const double side = std::sqrt(kTwoPi / n), cap = std::acos(1 - 1.0 / n);
  const int collars = std::max(1, static_cast<int>(std::lround((0.5 * kPi - cap) / side)));
  std::vector<UpperBand> from_zenith{{1 - 1.0 / n, 1.0, 1}};
  int placed = 1;
  for (int i = 1; i <= collars; ++i) {
    const double colatitude = cap + (0.5 * kPi - cap) * i / collars;
    int until = i == collars ? n : static_cast<int>(std::lround(n * (1 - std::cos(colatitude))));
    until = std::clamp(until, placed + 1, n - (collars - i));
    from_zenith.push_back({i == collars ? 0.0 : 1 - double(until) / n, 1 - double(placed) / n, until - placed});
    placed = until;
  }
  std::reverse(from_zenith.begin(), from_zenith.end());
  return from_zenith;
}

Error partition_error(const std::string& what, const std::string& where) {
  return {ErrorCode::usage, what, where, "use uniform:N (N even), tregenza, reinhart:K or fine:N"};
}

/// Azimuth of the first border of a band, radians from +x.
double start_azimuth(const SkyBand& band) { return band.centred ? -kPi / band.cells : 0.0; }

/// Integral over (from, to) of the altitude's hat that is 0 at `from` and 1 at `to`, times cos(altitude).
/// By parts: integral of (x - from)/(to - from) cos x = sin(to) + (cos(to) - cos(from))/(to - from).
double rising_hat(double from, double to) { return std::sin(to) + (std::cos(to) - std::cos(from)) / (to - from); }

} // namespace

Result<SkyPartition> SkyPartition::uniform(int regions) {
  const std::string text = "uniform:" + std::to_string(regions);
  if (regions < 2 || regions > kMaxRegions || regions % 2 != 0)
    return partition_error("the number of regions must be even and in 2..100000, the horizon is a border", text);
  return from_bands(mirrored(equal_area_hemisphere(regions / 2), false), text);
}

SkyPartition SkyPartition::tregenza() { return *from_bands(reinhart_bands(1), "tregenza"); }

Result<SkyPartition> SkyPartition::reinhart(int k) {
  const std::string text = "reinhart:" + std::to_string(k);
  if (k < 1 || k > 12)
    return partition_error("K must be in 1..12", text);
  return from_bands(reinhart_bands(k), text);
}

/// Rows of equal height in altitude, the side of a square cell of 4 pi / nodes steradians; each row has the multiple of
/// four cells that comes closest to square ones.
Result<SkyPartition> SkyPartition::fine(int nodes) {
  const std::string text = "fine:" + std::to_string(nodes);
  if (nodes < 16 || nodes > kMaxRegions)
    return partition_error("the number of nodes must be in 16..100000", text);
  const double side = std::sqrt(2 * kTwoPi / nodes);
  const int rows = std::max(1, static_cast<int>(std::lround(0.5 * kPi / side)));
  std::vector<UpperBand> upper;
  for (int i = 0; i < rows; ++i) {
    const double low = 0.5 * kPi * i / rows, high = 0.5 * kPi * (i + 1) / rows;
    const double around = kTwoPi * std::cos(0.5 * (low + high));
    upper.push_back({i == 0 ? 0.0 : upper.back().sin_high, i + 1 == rows ? 1.0 : std::sin(high),
                     4 * std::max(1, static_cast<int>(std::lround(0.25 * around / side)))});
  }
  const Result<SkyPartition> regions = from_bands(mirrored(upper, true), text);
  return regions ? Result<SkyPartition>(regions->with_interpolation(true)) : regions;
}

SkyPartition SkyPartition::with_interpolation(bool on) const {
  SkyPartition out = *this;
  out.interpolated_ = on;
  return out;
}

Result<SkyPartition> SkyPartition::parse(const std::string& text) {
  if (text == "tregenza")
    return tregenza();
  const std::size_t colon = text.find(':');
  const std::string kind = text.substr(0, colon);
  const auto number =
      colon == std::string::npos ? std::nullopt : parse_number<int>(std::string_view(text).substr(colon + 1));
  if (number && kind == "uniform")
    return uniform(*number);
  if (number && kind == "reinhart")
    return reinhart(*number);
  if (number && kind == "fine")
    return fine(*number);
  return partition_error("not a partition of the sky", text.substr(0, 60));
}

Result<SkyPartition> SkyPartition::from_bands(std::vector<SkyBand> bands, std::string name) {
  auto bad = [&](const std::string& what) {
    return Error{ErrorCode::value_invalid, what, "sky partition " + name, "the bands must cover the sphere once"};
  };
  if (bands.empty() || bands.front().sin_low != -1 || bands.back().sin_high != 1)
    return bad("the bands do not cover nadir to zenith");
  bool horizon = false;
  int next = 0;
  for (std::size_t i = 0; i < bands.size(); ++i) {
    const SkyBand& band = bands[i];
    if (!(band.sin_low < band.sin_high) || (i > 0 && band.sin_low != bands[i - 1].sin_high))
      return bad("band " + std::to_string(i) + " does not begin where the one below ends");
    if (band.cells < 1 || band.cells > 2 * kMaxRegions || band.first_region != next || next > 2 * kMaxRegions)
      return bad("band " + std::to_string(i) + " has a wrong number of cells or a wrong first region");
    horizon = horizon || band.sin_low == 0;
    next += band.cells;
  }
  if (!horizon)
    return bad("the horizon is not a border");
  SkyPartition out;
  out.bands_ = std::move(bands);
  out.name_ = std::move(name);
  out.size_ = next;
  for (const SkyBand& band : out.bands_)
    out.node_altitude_.push_back(std::asin(out.centre(band.first_region).z));
  return out;
}

/// Last band that begins at or below; the bands are sorted.
int SkyPartition::band_of(double sin_altitude) const {
  const auto above = std::upper_bound(bands_.begin(), bands_.end(), sin_altitude,
                                      [](double s, const SkyBand& band) { return s < band.sin_low; });
  return std::max(0, static_cast<int>(above - bands_.begin()) - 1);
}

const SkyBand& SkyPartition::band_of_region(int region) const {
  const auto above = std::upper_bound(bands_.begin(), bands_.end(), region,
                                      [](int r, const SkyBand& band) { return r < band.first_region; });
  return *(above - 1);
}

Result<SkyPartition> SkyPartition::from_rectangles(std::vector<SkyBand> bands, std::vector<SkyRectangle> rectangles,
                                                   std::string name) {
  const auto bad = [&](const std::string& what) {
    return Error{ErrorCode::value_invalid, what, "sky partition " + name, "the rectangles must cover every cell once"};
  };
  Result<SkyPartition> cells = from_bands(std::move(bands), name);
  if (!cells)
    return cells;
  SkyPartition out = std::move(*cells);
  if (out.size_ > kMostCells)
    return bad("there are more than " + std::to_string(kMostCells) + " cells");
  const int rows = static_cast<int>(out.bands_.size()), around = out.bands_.front().cells;
  for (const SkyBand& band : out.bands_)
    if (band.cells != around || band.centred)
      return bad("the bands have different numbers of cells");
  out.region_of_cell_.assign(static_cast<std::size_t>(out.size_), -1);
  for (std::size_t r = 0; r < rectangles.size(); ++r) {
    const SkyRectangle& e = rectangles[r];
    if (e.band < 0 || e.cell < 0 || e.bands < 1 || e.cells < 1 || e.band > rows - e.bands || e.cell > around - e.cells)
      return bad("rectangle " + std::to_string(r) + " lies outside the cells");
    const SkyBand &lowest = out.bands_[static_cast<std::size_t>(e.band)],
                  &highest = out.bands_[static_cast<std::size_t>(e.band + e.bands - 1)];
    if (lowest.sin_low < 0 && highest.sin_high > 0)
      return bad("rectangle " + std::to_string(r) + " crosses the horizon");
    for (int b = e.band; b < e.band + e.bands; ++b)
      for (int c = e.cell; c < e.cell + e.cells; ++c) {
        std::int32_t& region = out.region_of_cell_[static_cast<std::size_t>(b * around + c)];
        if (region >= 0)
          return bad("two rectangles overlap");
        region = static_cast<std::int32_t>(r);
      }
  }
  if (std::ranges::count(out.region_of_cell_, -1) > 0)
    return bad("some cells belong to no rectangle");
  out.size_ = static_cast<int>(rectangles.size());
  out.rectangles_ = std::move(rectangles);
  out.node_altitude_.clear();
  return out;
}

SkyRectangle SkyPartition::extent(int region) const {
  return rectangles_.empty() ? SkyRectangle{} : rectangles_[static_cast<std::size_t>(region)];
}

/// Cells have equal widths 2 pi / cells in azimuth; a rectangle spans whole cells and bands.
SkyPartition::Limits SkyPartition::limits(int region) const {
  if (rectangles_.empty()) {
    const SkyBand& band = band_of_region(region);
    const double width = kTwoPi / band.cells;
    return {band.sin_low, band.sin_high, start_azimuth(band) + width * (region - band.first_region), width,
            band.cells == 1};
  }
  const SkyRectangle& r = rectangles_[static_cast<std::size_t>(region)];
  const int around = bands_.front().cells;
  const double width = kTwoPi / around;
  return {bands_[static_cast<std::size_t>(r.band)].sin_low,
          bands_[static_cast<std::size_t>(r.band + r.bands - 1)].sin_high, width * r.cell, width * r.cells,
          r.cells == around};
}

/// Band by sin(altitude), cell by azimuth over cell width.
int SkyPartition::region_of(const glm::dvec3& d) const {
  const SkyBand& band = bands_[static_cast<std::size_t>(band_of(d.z))];
  if (band.cells == 1)
    return band.first_region;
  double turns = (std::atan2(d.y, d.x) - start_azimuth(band)) / kTwoPi;
  turns -= std::floor(turns);
  const int cell = band.first_region + std::min(static_cast<int>(turns * band.cells), band.cells - 1);
  return region_of_cell(cell);
}

/// Omega = width (sin high - sin low), steradians: exact, by Archimedes.
double SkyPartition::solid_angle_sr(int region) const {
  const Limits l = limits(region);
  return l.width * (l.sin_high - l.sin_low);
}

glm::dvec3 SkyPartition::centre(int region) const {
  const Limits l = limits(region);
  const double z = 0.5 * (l.sin_low + l.sin_high);
  if (l.whole_turn)
    return {0.0, 0.0, z < 0 ? -1.0 : 1.0};
  // Mean of cos(altitude) over the band, times the mean of the azimuth's cosine over the cell (a sinc).
  auto integral = [](double s) { return 0.5 * (s * std::sqrt(std::max(0.0, 1 - s * s)) + std::asin(s)); };
  const double half = 0.5 * l.width;
  const double across = (integral(l.sin_high) - integral(l.sin_low)) / (l.sin_high - l.sin_low) * std::sin(half) / half;
  const double azimuth = l.azimuth + half;
  return glm::normalize(glm::dvec3(across * std::cos(azimuth), across * std::sin(azimuth), z));
}

glm::dvec3 SkyPartition::sample(int region, double s, double t) const {
  // A hair inside the borders, so that rounding never moves a sample into the neighbour.
  constexpr double kInside = 1e-9;
  const Limits l = limits(region);
  const double u = std::clamp(s, kInside, 1 - kInside), v = std::clamp(t, kInside, 1 - kInside);
  const double azimuth = l.azimuth + l.width * u;
  const double z = l.sin_low + v * (l.sin_high - l.sin_low), across = std::sqrt(std::max(0.0, 1 - z * z));
  return {across * std::cos(azimuth), across * std::sin(azimuth), z};
}

/// Bilinear finite element in (azimuth, altitude): up = (h - h_low)/(h_high - h_low), right = fraction of the cell
/// width past the left node, in each of the two bands; weights are their products (Cohen & Wallace 1993, ch. 3).
std::array<RegionWeight, 4> SkyPartition::interpolation(const glm::dvec3& d) const {
  const double altitude = std::asin(std::clamp(d.z, -1.0, 1.0)), azimuth = std::atan2(d.y, d.x);
  const auto above = std::upper_bound(node_altitude_.begin(), node_altitude_.end(), altitude);
  const auto upper = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(above - node_altitude_.begin(), 1, std::ssize(node_altitude_) - 1));
  const double low = node_altitude_[upper - 1], high = node_altitude_[upper],
               up = std::clamp((altitude - low) / (high - low), 0.0, 1.0);
  std::array<RegionWeight, 4> weights;
  for (std::size_t k = 0; k < 2; ++k) {
    const SkyBand& band = bands_[upper - 1 + k];
    const double cell = (azimuth - start_azimuth(band)) / kTwoPi * band.cells - 0.5, first = std::floor(cell),
                 right = cell - first, of_band = k == 0 ? 1.0 - up : up;
    const int n = band.cells, left = ((static_cast<int>(first) % n) + n) % n;
    weights[2 * k] = {band.first_region + left, of_band * (1.0 - right)};
    weights[2 * k + 1] = {band.first_region + (left + 1) % n, of_band * right};
  }
  return weights;
}

/// Integral of the hat function over the sphere, steradians: the azimuth gives one cell width, the altitude the sum of
/// a rising and a falling side, each weighted with cos(altitude). The hats of all nodes sum to 4 pi.
double SkyPartition::hat_sr(int region) const {
  const SkyBand& band = band_of_region(region);
  const auto b = static_cast<std::size_t>(&band - bands_.data());
  const double here = node_altitude_[b];
  double band_integral = 0; // of cos(altitude) times the hat in altitude; 1 beyond the outermost nodes
  band_integral += b > 0 ? rising_hat(node_altitude_[b - 1], here) : std::sin(here) + 1.0;
  band_integral += b + 1 < bands_.size() ? rising_hat(-node_altitude_[b + 1], -here) : 1.0 - std::sin(here);
  return kTwoPi / band.cells * band_integral;
}

} // namespace daylit
