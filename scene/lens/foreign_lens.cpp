#include "scene/lens/foreign_lens.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <sstream>
#include <vector>

#include <glm/geometric.hpp>

#include "scene/core/text_lines.h"

namespace daylit::detail {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kWorst_px = 0.5; ///< between a foreign lens and the model that stands for it
constexpr int kSteps = 2000;

// ---- OCamCalib

/// Numbers after each heading, which begins with '#', in the order of the file.
std::vector<std::pair<std::string, std::vector<double>>> sections_of(const std::string& text) {
  std::vector<std::pair<std::string, std::vector<double>>> sections;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#')) {
      sections.push_back({line, {}});
      continue;
    }
    std::istringstream words(line);
    for (std::string word; !sections.empty() && words >> word;)
      sections.back().second.push_back(parse_number(word).value_or(std::nan("")));
  }
  return sections;
}

/// pixel = (stretch) (a, b) + middle, a along rows (down), b along columns (right); the ray is (a, b, polynomial(r)).
struct OcamModel {
  std::vector<double> polynomial; ///< of r, from the constant up; negative where the ray points forward
  double row = 0, column = 0, c = 1, d = 0, e = 0;
  int width = 0, height = 0;
  double field = 0.5 * std::numbers::pi;
  double theta(double r) const {
    double z = 0;
    for (std::size_t k = polynomial.size(); k-- > 0;)
      z = z * r + polynomial[k];
    return std::atan2(r, -z);
  }
};

Error malformed(const std::string& name, const std::string& what) {
  return {ErrorCode::file_malformed, what, name, "the text that OCamCalib exports, calib_results.txt, is read"};
}

Result<OcamModel> read_ocam(const std::string& text, const std::string& name) {
  OcamModel m;
  bool direct = false, centre = false, affine = false, size = false;
  for (const auto& [heading, n] : sections_of(text)) {
    for (const double v : n)
      if (!std::isfinite(v))
        return malformed(name, "no number below '" + heading.substr(0, 40) + "'");
    if (heading.find("DIRECT") != std::string::npos && n.size() >= 2 && n.size() <= 20 &&
        n[0] == static_cast<double>(n.size() - 1)) {
      m.polynomial.assign(n.begin() + 1, n.end());
      direct = m.polynomial[0] < 0;
    } else if (heading.find("center") != std::string::npos && n.size() == 2) {
      m.row = n[0], m.column = n[1];
      centre = true;
    } else if (heading.find("affine") != std::string::npos && n.size() == 3) {
      m.c = n[0], m.d = n[1], m.e = n[2];
      affine = m.c > 0.5 && m.c < 2.0;
    } else if (heading.find("image size") != std::string::npos && n.size() == 2) {
      size = n[0] >= 1 && n[1] >= 1 && n[0] <= 32768 && n[1] <= 32768;
      m.height = size ? static_cast<int>(n[0]) : 0;
      m.width = size ? static_cast<int>(n[1]) : 0;
    } else if (heading.find("max_theta_deg") != std::string::npos && n.size() == 1 && n[0] > 1 && n[0] < 180) {
      m.field = n[0] * kDegree;
    }
  }
  if (!direct || !centre || !affine || !size)
    return malformed(name, !direct   ? "no polynomial of the direct mapping that begins below zero"
                           : !centre ? "no centre"
                           : !affine ? "no affine parameters"
                                     : "no image size");
  return m;
}

/// Solves the normal equations of five unknowns; Gaussian elimination with pivots.
std::optional<std::array<double, 5>> solve(std::array<std::array<double, 6>, 5> a) {
  for (std::size_t k = 0; k < 5; ++k) {
    std::size_t best = k;
    for (std::size_t r = k + 1; r < 5; ++r)
      best = std::abs(a[r][k]) > std::abs(a[best][k]) ? r : best;
    std::swap(a[k], a[best]);
    if (!(std::abs(a[k][k]) > 1e-300))
      return std::nullopt;
    for (std::size_t r = 0; r < 5; ++r)
      for (std::size_t c = 5; r != k && c + 1 > k; --c)
        a[r][c] -= a[r][k] / a[k][k] * a[k][c];
  }
  std::array<double, 5> x{};
  for (std::size_t k = 0; k < 5; ++k)
    x[k] = a[k][5] / a[k][k];
  return x;
}

/// The curve of an OCam model: angles at even steps of the radius, up to the field, while it rises.
std::vector<glm::dvec2> curve_of(const OcamModel& m) {
  const double farthest = std::hypot(std::max(m.row, m.height - m.row), std::max(m.column, m.width - m.column));
  std::vector<glm::dvec2> curve;
  for (int k = 1; k <= kSteps; ++k) {
    const double r = farthest * k / kSteps, theta = m.theta(r);
    if (theta > m.field || (!curve.empty() && theta <= curve.back().x))
      break;
    curve.emplace_back(theta, r);
  }
  return curve;
}

/// r = f t (1 + k1 t^2 + ... + k4 t^8), linear in f, f k1, ..., f k4; angles in units of the largest one.
bool fit_curve(const std::vector<glm::dvec2>& curve, double field, LensModel& lens) {
  std::array<std::array<double, 6>, 5> normal{};
  for (const glm::dvec2& p : curve) {
    std::array<double, 6> row{};
    for (std::size_t k = 0; k < 5; ++k)
      row[k] = std::pow(p.x / field, 2.0 * static_cast<double>(k) + 1.0);
    row[5] = p.y;
    for (std::size_t i = 0; i < 5; ++i)
      for (std::size_t j = 0; j < 6; ++j)
        normal[i][j] += row[i] * row[j];
  }
  const auto x = solve(normal);
  if (!x || !((*x)[0] > 0))
    return false;
  lens.fx = (*x)[0] / field;
  for (std::size_t k = 0; k < 4; ++k)
    lens.distortion[k] = (*x)[k + 1] / (*x)[0] / std::pow(field, 2.0 * static_cast<double>(k) + 2.0);
  return true;
}

/// Largest distance of pixels between the two, over the field.
double worst_distance(const OcamModel& m, const std::vector<glm::dvec2>& curve, const LensModel& lens) {
  double worst = 0;
  for (const glm::dvec2& p : curve)
    for (int k = 0; k < 16; ++k) {
      const double phi = 2.0 * std::numbers::pi * k / 16, a = p.y * std::sin(phi), b = p.y * std::cos(phi);
      const double theta = 0.999999 * p.x;
      const auto at = lens.project({std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)});
      const glm::dvec2 truth(m.e * a + b + m.column, m.c * a + m.d * b + m.row);
      worst = std::max(worst, at ? glm::distance(*at, truth) : 1e9);
    }
  return worst;
}

// ---- Radiance

/// The options of a view, as "vh" -> {180}.
std::map<std::string, std::vector<double>> view_options(const std::string& view) {
  std::map<std::string, std::vector<double>> options;
  std::istringstream words(view);
  std::string current;
  for (std::string word; words >> word;) {
    if (const auto number = parse_number(word); number && std::isfinite(*number))
      options[current].push_back(*number);
    else
      options[current = word] = {};
  }
  return options;
}

std::optional<glm::dvec3> vector_of(const std::map<std::string, std::vector<double>>& options, const char* name,
                                    const glm::dvec3& otherwise) {
  const auto found = options.find(name);
  if (found == options.end())
    return otherwise;
  if (found->second.size() != 3)
    return std::nullopt;
  const glm::dvec3 v(found->second[0], found->second[1], found->second[2]);
  return glm::length(v) > 1e-9 ? std::optional(glm::normalize(v)) : std::nullopt;
}

/// A single number; nothing: not given, or more than one.
std::optional<double> number_of(const std::map<std::string, std::vector<double>>& options, const char* name) {
  const auto found = options.find(name);
  return found != options.end() && found->second.size() == 1 ? std::optional(found->second[0]) : std::nullopt;
}

/// Columns right, down, forward, as Radiance's viewport has them: right = forward x up.
std::optional<glm::dmat3> orientation_of(const std::map<std::string, std::vector<double>>& options) {
  const auto forward = vector_of(options, "-vd", {0, 1, 0}), up = vector_of(options, "-vu", {0, 0, 1});
  if (!forward || !up || glm::length(glm::cross(*forward, *up)) < 1e-6)
    return std::nullopt;
  const glm::dvec3 right = glm::normalize(glm::cross(*forward, *up));
  return glm::dmat3(right, glm::cross(*forward, right), *forward);
}

} // namespace

bool is_ocam(const std::string& text) { return text.starts_with("#polynomial coefficients for the DIRECT mapping"); }

Result<LensModel> parse_ocam(const std::string& text, const std::string& name) {
  const auto m = read_ocam(text, name);
  if (!m)
    return m.error();
  const std::vector<glm::dvec2> curve = curve_of(*m);
  LensModel lens;
  lens.kind = LensKind::equidistant;
  lens.width_px = m->width;
  lens.height_px = m->height;
  lens.cx = m->column;
  lens.cy = m->row;
  if (curve.size() < 100 || !fit_curve(curve, curve.back().x, lens))
    return Error{ErrorCode::value_invalid, "the polynomial does not rise from the middle of the picture", name,
                 "calibrate again, for example with daylit-calibrate fisheye"};
  lens.fy = lens.fx * m->c;
  lens.max_theta = monotone_field(lens.kind, lens.distortion, curve.back().x);
  if (const double worst = worst_distance(*m, curve, lens); !(worst < kWorst_px))
    return Error{ErrorCode::value_invalid,
                 "the polynomial, or its affine part, is " + std::to_string(worst).substr(0, 5) +
                     " pixels from any lens of four coefficients",
                 name, "state a smaller field with a line #max_theta_deg, or calibrate with daylit-calibrate fisheye"};
  return lens;
}

bool is_radiance(const std::string& text) { return text.starts_with("#?RADIANCE") || text.starts_with("#?RGBE"); }

Result<LensModel> parse_radiance_view(const std::string& header, const std::string& name) {
  std::string view, size;
  std::istringstream lines(header);
  std::string line;
  while (std::getline(lines, line) && !line.empty())
    if (const std::size_t at = line.find("VIEW="); at != std::string::npos)
      view = line.substr(at + 5);
  std::getline(lines, size);
  LensModel lens;
  if (std::sscanf(size.c_str(), "-Y %d +X %d", &lens.height_px, &lens.width_px) != 2 || lens.width_px < 1 ||
      lens.height_px < 1 || lens.width_px > 32768 || lens.height_px > 32768)
    return Error{ErrorCode::file_malformed, "no resolution line -Y HEIGHT +X WIDTH after the header", name, ""};
  const auto options = view_options(view);
  const auto refuse = [&](const std::string& what) {
    return Error{ErrorCode::value_invalid, what,
                 name + ", VIEW=", "a whole view of type -vta or -vtv is read as a lens"};
  };
  for (const char* cut : {"-vs", "-vl"})
    if (number_of(options, cut).value_or(0.0) != 0.0)
      return refuse("the view is shifted");
  const bool fisheye = options.contains("-vta");
  const auto across = number_of(options, "-vh"), down = number_of(options, "-vv");
  if ((!fisheye && !options.contains("-vtv")) || !across || !down || !(*across > 0) || !(*down > 0) ||
      !(std::max(*across, *down) < (fisheye ? 360.0 : 180.0)))
    return refuse(view.empty() ? "the header has no view" : "another view than -vta or -vtv with -vh and -vv");
  const auto orientation = orientation_of(options);
  if (!orientation)
    return refuse("-vd and -vu give no orientation");
  lens.kind = fisheye ? LensKind::equidistant : LensKind::pinhole;
  const auto focal = [&](int pixels, double degrees) {
    return 0.5 * pixels / (fisheye ? 0.5 * degrees * kDegree : std::tan(0.5 * degrees * kDegree));
  };
  lens.fx = focal(lens.width_px, *across);
  lens.fy = focal(lens.height_px, *down);
  lens.cx = 0.5 * (lens.width_px - 1);
  lens.cy = 0.5 * (lens.height_px - 1);
  lens.max_theta = 0.5 * (fisheye ? std::max(*across, *down) * kDegree : std::numbers::pi);
  lens.world_from_camera = *orientation;
  return lens;
}

} // namespace daylit::detail
