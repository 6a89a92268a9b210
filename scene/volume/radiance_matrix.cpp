#include "scene/volume/radiance_matrix.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include <fmt/format.h>

namespace daylit {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::array<int, 7> kTregenzaCells{30, 30, 24, 24, 18, 12, 6};

Error bad_matrix(const std::string& name, std::string what) {
  return {ErrorCode::file_malformed, std::move(what), name,
          "expected a Radiance matrix: NROWS, NCOLS, NCOMP=3, FORMAT"};
}

struct Header {
  int rows = 0, columns = 0;
  MatrixFormat format = MatrixFormat::ascii;
  bool has_format = false, big_endian = false;
};

std::optional<int> positive(std::string_view text) {
  int value = 0;
  const auto [stop, ec] = std::from_chars(text.data(), text.data() + text.size(), value);
  return ec == std::errc{} && stop == text.data() + text.size() && value > 0 ? std::optional(value) : std::nullopt;
}

/// One line; an empty answer is no problem. Lines that are not known are history.
std::string read_header_line(std::string_view line, Header& header) {
  const auto value_of = [&](std::string_view key) -> std::optional<std::string_view> {
    return line.starts_with(key) ? std::optional(line.substr(key.size())) : std::nullopt;
  };
  if (const auto rows = value_of("NROWS=")) {
    header.rows = positive(*rows).value_or(0);
    return header.rows > 0 ? "" : "NROWS is no count";
  }
  if (const auto columns = value_of("NCOLS=")) {
    header.columns = positive(*columns).value_or(0);
    return header.columns > 0 ? "" : "NCOLS is no count";
  }
  if (const auto components = value_of("NCOMP="))
    return *components == "3" ? "" : "NCOMP is not 3";
  if (const auto order = value_of("BigEndian="))
    header.big_endian = *order == "1";
  if (const auto format = value_of("FORMAT=")) {
    header.has_format = true;
    header.format = *format == "float"    ? MatrixFormat::float32
                    : *format == "double" ? MatrixFormat::float64
                                          : MatrixFormat::ascii;
    return *format == "ascii" || *format == "float" || *format == "double" ? ""
                                                                           : "FORMAT is not ascii, float or double";
  }
  return "";
}

/// The header's lines; `rest` is what follows the blank line.
std::string read_header(std::string_view& rest, Header& header) {
  if (!rest.starts_with("#?RADIANCE\n"))
    return "it does not start with #?RADIANCE";
  while (true) {
    const std::size_t end = rest.find('\n');
    if (end == std::string_view::npos)
      return "the header does not end";
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(end + 1);
    if (line.empty())
      break;
    if (std::string problem = read_header_line(line, header); !problem.empty())
      return problem;
  }
  return header.rows > 0 && header.columns > 0 && header.has_format ? "" : "the header lacks NROWS, NCOLS or FORMAT";
}

template <class Number>
Number binary_number(const char* bytes, bool swap) {
  std::array<char, sizeof(Number)> raw{};
  std::memcpy(raw.data(), bytes, sizeof(Number));
  if (swap)
    std::reverse(raw.begin(), raw.end());
  return std::bit_cast<Number>(raw);
}

template <class Number>
void append_binary(std::string& text, const Rgb& value) {
  for (int c = 0; c < 3; ++c) {
    const auto raw = std::bit_cast<std::array<char, sizeof(Number)>>(static_cast<Number>(value[c]));
    text.append(raw.data(), raw.size());
  }
}

/// False: no number is left.
bool next_number(const char*& p, const char* end, float& value) {
  while (p < end && (*p == ' ' || *p == '\t' || *p == '\n' || *p == '\r'))
    ++p;
  const auto [stop, ec] = std::from_chars(p, end, value);
  if (ec != std::errc{})
    return false;
  p = stop;
  return true;
}

bool read_ascii(std::string_view text, std::vector<Rgb>& values) {
  const char *p = text.data(), *end = p + text.size();
  for (Rgb& value : values)
    for (int c = 0; c < 3; ++c)
      if (!next_number(p, end, value[c]))
        return false;
  float extra = 0.0f;
  return !next_number(p, end, extra);
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

Result<RadianceMatrix> parse_matrix(const std::string& text, const std::string& name) {
  std::string_view rest = text;
  Header header;
  if (std::string problem = read_header(rest, header); !problem.empty())
    return bad_matrix(name, std::move(problem));
  const std::size_t count = static_cast<std::size_t>(header.rows) * static_cast<std::size_t>(header.columns);
  // Five characters and a separator are the least for three numbers of text.
  const std::size_t size = header.format == MatrixFormat::float32   ? 12
                           : header.format == MatrixFormat::float64 ? 24
                                                                    : 6;
  const bool fits = header.format == MatrixFormat::ascii ? count <= rest.size() / 5 : rest.size() == count * size;
  if (!fits)
    return bad_matrix(name, fmt::format("{} x {} values do not fit its size", header.rows, header.columns));
  RadianceMatrix matrix{header.rows, header.columns, std::vector<Rgb>(count)};
  if (header.format == MatrixFormat::ascii && !read_ascii(rest, matrix.value))
    return bad_matrix(name, "a value is not a number, or there are too few or too many");
  if (header.format != MatrixFormat::ascii)
    for (std::size_t i = 0; i < 3 * count; ++i) {
      const char* at = rest.data() + i * size / 3;
      matrix.value[i / 3][static_cast<int>(i % 3)] =
          size == 12 ? binary_number<float>(at, header.big_endian)
                     : static_cast<float>(std::clamp(binary_number<double>(at, header.big_endian), -1e300, 1e300));
    }
  for (const Rgb& v : matrix.value)
    if (!std::isfinite(v.r) || !std::isfinite(v.g) || !std::isfinite(v.b))
      return bad_matrix(name, "a value is not finite");
  return matrix;
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
