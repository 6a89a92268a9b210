#include "calibration/colour_science.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "scene/core/read_file.h"
#include "scene/core/text_lines.h"
#include "scene/image/image_formats.h"

namespace daylit::calibration {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kFirst_nm = 380.0, kStep_nm = 10.0;

// CIE 1931 colour matching functions x, y, z and the relative power of CIE D65, from 380 to 780 nm.
constexpr double kCie[][4] = {
    {0.001368, 3.9e-05, 0.00645, 49.98}, {0.004243, 0.00012, 0.02005, 54.65}, {0.01431, 0.000396, 0.06785, 82.75},
    {0.04351, 0.00121, 0.2074, 91.49},   {0.13438, 0.004, 0.6456, 93.43},     {0.2839, 0.0116, 1.3856, 86.68},
    {0.34828, 0.023, 1.74706, 104.86},   {0.3362, 0.038, 1.77211, 117.01},    {0.2908, 0.06, 1.6692, 117.81},
    {0.19536, 0.09098, 1.28764, 114.86}, {0.09564, 0.13902, 0.81295, 115.92}, {0.03201, 0.20802, 0.46518, 108.81},
    {0.0049, 0.323, 0.272, 109.35},      {0.0093, 0.503, 0.1582, 107.8},      {0.06327, 0.71, 0.07825, 104.79},
    {0.1655, 0.862, 0.04216, 107.69},    {0.2904, 0.954, 0.0203, 104.41},     {0.43345, 0.99495, 0.00875, 104.05},
    {0.5945, 0.995, 0.0039, 100},        {0.7621, 0.952, 0.0021, 96.33},      {0.9163, 0.87, 0.00165, 95.79},
    {1.0263, 0.757, 0.0011, 88.69},      {1.0622, 0.631, 0.0008, 90.01},      {1.0026, 0.503, 0.00034, 89.6},
    {0.85445, 0.381, 0.00019, 87.7},     {0.6424, 0.265, 5e-05, 83.29},       {0.4479, 0.175, 2e-05, 83.7},
    {0.2835, 0.107, 0, 80.03},           {0.1649, 0.061, 0, 80.21},           {0.0874, 0.032, 0, 82.28},
    {0.04677, 0.017, 0, 78.28},          {0.0227, 0.00821, 0, 69.72},         {0.0113592, 0.004102, 0, 71.61},
    {0.00579035, 0.002091, 0, 74.35},    {0.00289933, 0.001047, 0, 61.6},     {0.00143997, 0.00052, 0, 69.89},
    {0.000690079, 0.0002492, 0, 75.09},  {0.000332301, 0.00012, 0, 63.59},    {0.000166151, 6e-05, 0, 46.42},
    {8.30753e-05, 3e-05, 0, 66.81},      {4.15099e-05, 1.499e-05, 0, 63.38},
};

// IEC 61966-2-1: XYZ (D65 white, Y = 1) to linear Rec. 709, and back; by columns.
const glm::dmat3 kFromXyz{
    {3.2404542, -0.9692660, 0.0556434}, {-1.5371385, 1.8760108, -0.2040259}, {-0.4985314, 0.0415560, 1.0572252}};
const glm::dmat3 kToXyz = glm::inverse(kFromXyz);

// sRGB values of the 24 patches as their maker published them for D65 (ColorChecker, 2005).
constexpr std::uint8_t kPublished[kPatches][3] = {
    {115, 82, 68},   {194, 150, 130}, {98, 122, 157},  {87, 108, 67},   {133, 128, 177}, {103, 189, 170},
    {214, 126, 44},  {80, 91, 166},   {193, 90, 99},   {94, 60, 108},   {157, 188, 64},  {224, 163, 46},
    {56, 61, 150},   {70, 148, 73},   {175, 54, 60},   {231, 199, 31},  {187, 86, 149},  {8, 133, 161},
    {243, 243, 242}, {200, 200, 200}, {160, 160, 160}, {122, 122, 121}, {85, 85, 85},    {52, 52, 52}};

Error bad_reference(const std::string& what, const std::string& where) {
  return {
      ErrorCode::value_invalid, what, where,
      "24 lines of R,G,B (sRGB, 0 to 255), or a table of reflectances: a heading with \"dark skin\" and the 23 other "
      "patches after it, then a line per wavelength, nm first"};
}

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  while (true) {
    const std::size_t end = std::min(line.find(','), line.size());
    cells.push_back(trimmed(line.substr(0, end)));
    if (end == line.size())
      return cells;
    line.remove_prefix(end + 1);
  }
}

/// Wavelengths and reflectances of the patches, from the columns of the table.
struct Spectra {
  std::vector<double> nm;
  std::array<std::vector<double>, kPatches> reflectance;
};

double interpolated(const std::vector<double>& x, const std::vector<double>& y, double at) {
  const auto above = std::ranges::lower_bound(x, at);
  if (above == x.begin())
    return y.front();
  if (above == x.end())
    return y.back();
  const auto k = static_cast<std::size_t>(above - x.begin());
  return y[k - 1] + (at - x[k - 1]) / (x[k] - x[k - 1]) * (y[k] - y[k - 1]);
}

Result<ChartReference> from_spectra(TextLines& lines, std::size_t first, const std::string& name) {
  Spectra s;
  for (std::string_view line; lines.next(line);) {
    const auto cells = cells_of(line);
    if (cells.size() < first + kPatches)
      continue;
    const std::string where = name + ", line " + std::to_string(lines.number());
    const auto nm = parse_number(cells[0]);
    if (!nm || (!s.nm.empty() && !(*nm > s.nm.back())))
      return bad_reference("wavelengths that do not rise", where);
    s.nm.push_back(*nm);
    for (std::size_t p = 0; p < kPatches; ++p) {
      const auto r = parse_number(cells[first + p]);
      if (!r || !(*r >= 0 && *r <= 2))
        return bad_reference("a reflectance that is none", where);
      s.reflectance[p].push_back(*r);
    }
  }
  if (s.nm.size() < 10 || s.nm.front() > 420 || s.nm.back() < 680)
    return bad_reference("wavelengths that do not reach from 420 to 680 nm", name);
  ChartReference chart;
  for (std::size_t p = 0; p < kPatches; ++p)
    chart[p] = rec709_of_reflectance(s.nm, s.reflectance[p]);
  return chart;
}

Result<ChartReference> from_srgb(const std::vector<std::vector<std::string_view>>& rows, const std::string& name) {
  ChartReference chart;
  if (rows.size() != kPatches)
    return bad_reference(std::to_string(rows.size()) + " lines instead of 24", name);
  for (std::size_t p = 0; p < kPatches; ++p)
    for (std::size_t c = 0; c < 3; ++c) {
      const auto code = rows[p].size() == 3 ? parse_number(rows[p][c]) : std::nullopt;
      if (!code || !(*code >= 0 && *code <= 255))
        return bad_reference("not R,G,B of 0 to 255", name + ", line " + std::to_string(p + 1));
      chart[p][static_cast<int>(c)] = static_cast<double>(srgb_decode(static_cast<float>(*code) / 255.0f));
    }
  return chart;
}

} // namespace

glm::dvec3 rec709_of_reflectance(std::span<const double> nm, std::span<const double> reflectance) {
  const std::vector<double> x(nm.begin(), nm.end()), y(reflectance.begin(), reflectance.end());
  glm::dvec3 xyz(0.0);
  double white = 0;
  for (std::size_t k = 0; k < std::size(kCie); ++k) {
    const double r = interpolated(x, y, kFirst_nm + kStep_nm * static_cast<double>(k));
    xyz += r * kCie[k][3] * glm::dvec3(kCie[k][0], kCie[k][1], kCie[k][2]);
    white += kCie[k][3] * kCie[k][1];
  }
  return kFromXyz * (xyz / white);
}

// CIE 15:2004, eqs. 8.3 to 8.8, for the white of Rec. 709.
glm::dvec3 lab_of(const glm::dvec3& rec709) {
  const glm::dvec3 xyz = kToXyz * rec709, white = kToXyz * glm::dvec3(1.0);
  glm::dvec3 f;
  for (int c = 0; c < 3; ++c) {
    const double t = xyz[c] / white[c];
    f[c] = t > 216.0 / 24389 ? std::cbrt(t) : (24389.0 / 27 * t + 16) / 116;
  }
  return {116 * f.y - 16, 500 * (f.x - f.y), 200 * (f.y - f.z)};
}

// Sharma, Wu, Dalal 2005, eqs. 2 to 22.
double delta_e_2000(const glm::dvec3& a, const glm::dvec3& b) {
  const auto seventh = [](double c) { return std::sqrt(std::pow(c, 7) / (std::pow(c, 7) + std::pow(25.0, 7))); };
  const double g = 0.5 * (1 - seventh(0.5 * (std::hypot(a.y, a.z) + std::hypot(b.y, b.z))));
  const double a1 = (1 + g) * a.y, a2 = (1 + g) * b.y;
  const double c1 = std::hypot(a1, a.z), c2 = std::hypot(a2, b.z);
  const auto hue = [](double y, double x) {
    const double h = x == 0 && y == 0 ? 0 : std::atan2(y, x) / kDegree;
    return h < 0 ? h + 360 : h;
  };
  const double h1 = hue(a.z, a1), h2 = hue(b.z, a2);
  double dh = c1 * c2 == 0 ? 0 : h2 - h1;
  dh += dh > 180 ? -360 : dh < -180 ? 360 : 0;
  double h = c1 * c2 == 0 ? h1 + h2 : 0.5 * (h1 + h2);
  if (c1 * c2 != 0 && std::abs(h1 - h2) > 180)
    h += h1 + h2 < 360 ? 180 : -180;
  const double l = 0.5 * (a.x + b.x), c = 0.5 * (c1 + c2),
               big_h = 2 * std::sqrt(c1 * c2) * std::sin(0.5 * dh * kDegree);
  const double t = 1 - 0.17 * std::cos((h - 30) * kDegree) + 0.24 * std::cos(2 * h * kDegree) +
                   0.32 * std::cos((3 * h + 6) * kDegree) - 0.20 * std::cos((4 * h - 63) * kDegree);
  const double turn = 30 * std::exp(-std::pow((h - 275) / 25, 2));
  const double sl = 1 + 0.015 * std::pow(l - 50, 2) / std::sqrt(20 + std::pow(l - 50, 2));
  const double x = (b.x - a.x) / sl, y = (c2 - c1) / (1 + 0.045 * c), z = big_h / (1 + 0.015 * c * t);
  return std::sqrt(std::max(0.0, x * x + y * y + z * z - std::sin(2 * turn * kDegree) * 2 * seventh(c) * y * z));
}

ChartReference published_chart() {
  ChartReference chart;
  for (std::size_t p = 0; p < kPatches; ++p)
    for (std::size_t c = 0; c < 3; ++c)
      chart[p][static_cast<int>(c)] = static_cast<double>(srgb_decode(static_cast<float>(kPublished[p][c]) / 255.0f));
  return chart;
}

Result<ChartReference> read_chart_reference(const std::filesystem::path& path) {
  const auto bytes = read_whole_file(path, std::size_t{1} << 24);
  if (!bytes)
    return bytes.error();
  const std::string text(bytes->begin(), bytes->end());
  TextLines lines(text);
  std::vector<std::vector<std::string_view>> rows;
  for (std::string_view line; lines.next(line);) {
    auto cells = cells_of(line);
    if (const auto first = std::ranges::find(cells, "dark skin"); first != cells.end())
      return from_spectra(lines, static_cast<std::size_t>(first - cells.begin()), path.string());
    if (!trimmed(line).empty())
      rows.push_back(std::move(cells));
  }
  return from_srgb(rows, path.string());
}

} // namespace daylit::calibration
