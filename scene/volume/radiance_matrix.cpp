#include "scene/volume/radiance_matrix.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace daylit {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::array<int, 7> kTregenzaCells{30, 30, 24, 24, 18, 12, 6};

template <class Number>
void append_binary(std::string& text, const Rgb& value) {
  for (int c = 0; c < 3; ++c) {
    const auto raw = std::bit_cast<std::array<char, sizeof(Number)>>(static_cast<Number>(value[c]));
    text.append(raw.data(), raw.size());
  }
}

/// Integral of (1 at `one`, 0 at `zero`, linear between) times the cosine, from..to.
double linear_times_cosine(double from, double to, double zero, double one) {
  const double slope = 1.0 / (one - zero);
  const auto primitive = [&](double x) { return slope * ((x - zero) * std::sin(x) + std::cos(x)); };
  return to > from ? primitive(to) - primitive(from) : 0.0;
}

/// Integral of band b's hat in altitude, times the cosine, between two sines of altitude. Beyond the outermost centres
/// the hat is 1.
double hat_height(const SkyPartition& partition, std::size_t b, double sin_low, double sin_high) {
  const auto centre = [&](std::size_t k) { return std::asin(partition.centre(partition.bands()[k].first_region).z); };
  const double low = std::asin(sin_low), high = std::asin(sin_high), here = centre(b);
  double sum = 0.0;
  if (b > 0)
    sum += linear_times_cosine(std::max(low, centre(b - 1)), std::min(high, here), centre(b - 1), here);
  else if (low < here)
    sum += std::sin(std::min(high, here)) - sin_low;
  if (b + 1 < partition.bands().size())
    sum += linear_times_cosine(std::max(low, here), std::min(high, centre(b + 1)), centre(b + 1), here);
  else if (high > here)
    sum += sin_high - std::sin(std::max(low, here));
  return sum;
}

/// Of two intervals of the sine of altitude: solid angle per radian of azimuth.
double overlap(const SkyBand& band, double sin_low, double sin_high) {
  return std::min(band.sin_high, sin_high) - std::max(band.sin_low, sin_low);
}

/// Integral over an interval of azimuth of the cell's box, or of its hat, radians.
double azimuth_overlap(const SkyBand& band, int cell, bool hat, double middle, double width) {
  if (band.cells == 1)
    return width;
  const double step = 2.0 * kPi / band.cells, centre = step * (band.centred ? cell : cell + 0.5);
  const auto primitive = [&](double u) {
    if (!hat)
      return std::clamp(u + 0.5, 0.0, 1.0);
    const double v = std::clamp(u, -1.0, 1.0);
    return v < 0.0 ? 0.5 * (1.0 + v) * (1.0 + v) : 0.5 + v - 0.5 * v * v;
  };
  double sum = 0.0;
  const double away = std::remainder(middle - centre, 2.0 * kPi);
  for (int turn = -1; turn <= 1; ++turn) {
    const double from = away + 2.0 * kPi * turn - 0.5 * width;
    sum += primitive((from + width) / step) - primitive(from / step);
  }
  return step * sum;
}

} // namespace

std::string matrix_text(const RadianceMatrix& m, MatrixFormat format, const std::string& comment) {
  constexpr std::array<const char*, 3> kName{"ascii", "float", "double"};
  static_assert(std::endian::native == std::endian::little);
  std::string text = "#?RADIANCE\n";
  if (!comment.empty())
    text += comment + "\n";
  text += fmt::format("NROWS={}\nNCOLS={}\nNCOMP=3\n", m.rows, m.columns);
  if (format != MatrixFormat::ascii)
    text += "BigEndian=0\n";
  text += fmt::format("FORMAT={}\n\n", kName[static_cast<std::size_t>(format)]);
  for (int row = 0; row < m.rows; ++row) {
    for (int column = 0; column < m.columns; ++column) {
      const Rgb& v = m.at(row, column);
      if (format == MatrixFormat::ascii)
        text += fmt::format("{:.9g} {:.9g} {:.9g}\t", v.r, v.g, v.b);
      else if (format == MatrixFormat::float32)
        append_binary<float>(text, v);
      else
        append_binary<double>(text, v);
    }
    if (format == MatrixFormat::ascii)
      text += '\n';
  }
  return text;
}

/// Rows are 90 / (7 K + 1/2) degrees high; each of Tregenza's seven rows of cells becomes K rows of K times as many
/// (Reinhart's subdivision, reinhart.cal of Radiance).
Result<ReinhartPatches> ReinhartPatches::make(int k) {
  if (k < 1 || k > 12)
    return Error{ErrorCode::value_invalid, fmt::format("{} is no subdivision", k), "Reinhart patches", "1 to 12"};
  ReinhartPatches patches;
  const double height = 0.5 * kPi / (7 * k + 0.5);
  int next = 1;
  for (int i = 0; i < 7 * k; ++i) {
    const int cells = k * kTregenzaCells[static_cast<std::size_t>(i / k)];
    patches.rows_.push_back({std::sin(height * i), std::sin(height * (i + 1)), height * (i + 0.5), cells, next});
    next += cells;
  }
  patches.rows_.push_back({patches.rows_.back().sin_high, 1.0, 0.5 * kPi, 1, next});
  patches.size_ = next + 1;
  return patches;
}

const ReinhartPatches::Row& ReinhartPatches::row_of(int patch) const {
  return *(std::upper_bound(rows_.begin(), rows_.end(), patch, [](int p, const Row& row) { return p < row.first; }) -
           1);
}

int ReinhartPatches::patch_of(const glm::dvec3& d) const {
  if (d.z < 0.0)
    return 0;
  const auto above =
      std::upper_bound(rows_.begin(), rows_.end(), d.z, [](double z, const Row& row) { return z < row.sin_high; });
  const Row& row = above == rows_.end() ? rows_.back() : *above;
  const double turns = std::atan2(d.x, d.y) / (2.0 * kPi); // clockwise from north
  const int cell = static_cast<int>(std::floor(turns * row.cells + 0.5));
  return row.first + (cell % row.cells + row.cells) % row.cells;
}

/// 2 pi (sin of the upper limit - sin of the lower one) / cells.
double ReinhartPatches::solid_angle_sr(int patch) const {
  if (patch == 0)
    return 2.0 * kPi;
  const Row& row = row_of(patch);
  return 2.0 * kPi * (row.sin_high - row.sin_low) / row.cells;
}

glm::dvec3 ReinhartPatches::centre(int patch) const {
  if (patch == 0)
    return {0.0, 0.0, -1.0};
  const Row& row = row_of(patch);
  const double azimuth = 2.0 * kPi * (patch - row.first) / row.cells;
  return {std::cos(row.altitude) * std::sin(azimuth), std::cos(row.altitude) * std::cos(azimuth),
          std::sin(row.altitude)};
}

/// Uniform in azimuth and in the sine of altitude is uniform in solid angle (Archimedes).
glm::dvec3 ReinhartPatches::sample(int patch, double s, double t) const {
  const Row ground{-1.0, 0.0, 0.0, 1, 0};
  const Row& row = patch == 0 ? ground : row_of(patch);
  const double azimuth = 2.0 * kPi * (patch - row.first - 0.5 + s) / row.cells;
  const double z = row.sin_low + t * (row.sin_high - row.sin_low), across = std::sqrt(std::max(0.0, 1.0 - z * z));
  return {across * std::sin(azimuth), across * std::cos(azimuth), z};
}

/// Mean over a region, or over a node's hat h, of a sky that is 1 in the patch: integral of h over the patch / solid
/// angle. Patch, regions and hats are products of a function of altitude and one of azimuth, and so is the integral.
std::vector<RegionWeight> ReinhartPatches::region_radiances(int patch, const SkyPartition& partition) const {
  const Row ground{-1.0, 0.0, 0.0, 1, 0};
  const Row& row = patch == 0 ? ground : row_of(patch);
  const double width = 2.0 * kPi / row.cells;
  const double middle = 0.5 * kPi - width * (patch - row.first); // counter-clockwise from +x
  std::vector<RegionWeight> weights;
  for (std::size_t b = 0; b < partition.bands().size(); ++b) {
    const double height = partition.interpolated() ? hat_height(partition, b, row.sin_low, row.sin_high)
                                                   : overlap(partition.bands()[b], row.sin_low, row.sin_high);
    const SkyBand& band = partition.bands()[b];
    for (int cell = 0; height > 0.0 && cell < band.cells; ++cell) {
      const int region = partition.region_of_cell(band.first_region + cell);
      const double sr = height * azimuth_overlap(band, cell, partition.interpolated(), middle, width);
      if (sr > 0.0)
        weights.push_back({region, sr / partition.solid_angle_sr(region)});
    }
  }
  return weights;
}

} // namespace daylit
