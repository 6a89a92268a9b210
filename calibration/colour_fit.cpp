#include "calibration/colour_fit.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <opencv2/core.hpp>

namespace daylit::calibration {

namespace {

constexpr std::size_t kFewestPatches = 18;
constexpr int kRounds = 40, kHeldOutRounds = 12;
constexpr double kStep = 1e-6;
constexpr double kBetter = 0.97; ///< held-out error / that of the simpler model, from which a richer one is taken

const glm::dvec3 kLuminance(0.2126, 0.7152, 0.0722);

struct Known {
  ChartPatch patch;
  glm::dvec3 colour{0.0}, lab{0.0};
};

std::size_t columns(const ColourTerms& terms) { return terms.roots ? 6 : 3; }

std::array<double, 6> features(const ColourModel& m, const glm::dvec3& code) {
  glm::dvec3 e;
  for (int c = 0; c < 3; ++c)
    e[c] = m.terms.curve ? std::pow(std::max(code[c] - m.pedestal[c], 1e-6), m.power) : std::max(code[c], 0.0);
  return {e.r, e.g, e.b, std::sqrt(e.r * e.g), std::sqrt(e.g * e.b), std::sqrt(e.r * e.b)};
}

/// The unknowns of a model one after another, and back.
std::vector<double> packed(const ColourModel& m) {
  std::vector<double> x;
  if (m.terms.curve)
    x = {m.pedestal.r, m.pedestal.g, m.pedestal.b, m.power};
  if (m.terms.uneven)
    x.insert(x.end(), {m.uneven.x, m.uneven.y});
  for (const auto& row : m.row)
    x.insert(x.end(), row.begin(), row.begin() + static_cast<std::ptrdiff_t>(columns(m.terms)));
  return x;
}

ColourModel unpacked(const ColourTerms& terms, const std::vector<double>& x) {
  ColourModel m;
  m.terms = terms;
  auto next = x.begin();
  if (terms.curve) {
    m.pedestal = {next[0], next[1], next[2]};
    m.power = next[3];
    next += 4;
  }
  if (terms.uneven) {
    m.uneven = {next[0], next[1]};
    next += 2;
  }
  for (auto& row : m.row) {
    std::copy_n(next, columns(terms), row.begin());
    next += static_cast<std::ptrdiff_t>(columns(terms));
  }
  return m;
}

// Differences in L*a*b* along lightness, chroma and hue of the known colour, each divided by its weight in CIEDE2000
// there: near zero the sum of squares is Delta E 2000 squared, but for the rotation of blues.
void residual(const ColourModel& m, const Known& known, double* out) {
  const glm::dvec3 d = lab_of(m.apply(known.patch.code, known.patch.at)) - known.lab;
  const double chroma = std::hypot(known.lab.y, known.lab.z), l = known.lab.x - 50;
  const double c = chroma > 0 ? known.lab.y / chroma : 1.0, s = chroma > 0 ? known.lab.z / chroma : 0.0;
  out[0] = d.x / (1 + 0.015 * l * l / std::sqrt(20 + l * l));
  out[1] = (c * d.y + s * d.z) / (1 + 0.045 * chroma);
  out[2] = (c * d.z - s * d.y) / (1 + 0.015 * chroma);
}

std::vector<double> residuals(const ColourModel& m, std::span<const Known> known) {
  std::vector<double> r(3 * known.size());
  for (std::size_t i = 0; i < known.size(); ++i)
    residual(m, known[i], &r[3 * i]);
  return r;
}

double square(const std::vector<double>& r) {
  double sum = 0;
  for (const double v : r)
    sum += v * v;
  return sum;
}

/// Normal equations by forward differences.
void linearise(const ColourTerms& terms, const std::vector<double>& x, const std::vector<double>& r,
               std::span<const Known> known, cv::Mat& normal, cv::Mat& gradient) {
  const int n = static_cast<int>(x.size());
  cv::Mat jacobian(static_cast<int>(r.size()), n, CV_64F);
  for (int j = 0; j < n; ++j) {
    std::vector<double> moved = x;
    moved[static_cast<std::size_t>(j)] += kStep;
    const std::vector<double> rj = residuals(unpacked(terms, moved), known);
    for (int i = 0; i < jacobian.rows; ++i)
      jacobian.at<double>(i, j) = (rj[static_cast<std::size_t>(i)] - r[static_cast<std::size_t>(i)]) / kStep;
  }
  normal = jacobian.t() * jacobian;
  gradient = -jacobian.t() * cv::Mat(r);
}

/// Levenberg-Marquardt.
ColourModel refined(const ColourModel& start, std::span<const Known> known, int rounds) {
  std::vector<double> x = packed(start), r = residuals(start, known);
  double cost = square(r), damping = 1e-3;
  for (int round = 0; round < rounds; ++round) {
    cv::Mat normal, gradient, step;
    linearise(start.terms, x, r, known, normal, gradient);
    bool better = false;
    for (int attempt = 0; attempt < 10 && !better; ++attempt, damping *= 4) {
      cv::Mat damped = normal.clone();
      for (int j = 0; j < damped.rows; ++j)
        damped.at<double>(j, j) += damping * normal.at<double>(j, j) + 1e-9;
      if (!cv::solve(damped, gradient, step, cv::DECOMP_CHOLESKY))
        continue;
      std::vector<double> moved = x;
      for (std::size_t j = 0; j < x.size(); ++j)
        moved[j] += step.at<double>(static_cast<int>(j));
      const std::vector<double> next = residuals(unpacked(start.terms, moved), known);
      const double now = square(next);
      if (!(now < cost))
        continue;
      better = true;
      const bool done = cost - now < 1e-7 * cost;
      x = moved;
      r = next;
      cost = now;
      damping /= 20;
      if (done)
        return unpacked(start.terms, x);
    }
    if (!better)
      break;
  }
  return unpacked(start.terms, x);
}

/// Where to begin: a 3 x 3 matrix by linear least squares, relative to the luminance of each patch.
ColourModel begin(const ColourTerms& terms, std::span<const Known> known) {
  ColourModel m;
  m.terms = terms;
  m.power = terms.curve ? 2.0 : 1.0;
  cv::Mat normal = cv::Mat::zeros(3, 3, CV_64F), right = cv::Mat::zeros(3, 3, CV_64F), solution;
  for (const Known& k : known) {
    const auto f = features(m, k.patch.code);
    const double w = std::pow(std::max(glm::dot(k.colour, kLuminance), 1e-3), -1.4);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        normal.at<double>(i, j) += w * f[static_cast<std::size_t>(i)] * f[static_cast<std::size_t>(j)];
        right.at<double>(i, j) += w * f[static_cast<std::size_t>(i)] * k.colour[j];
      }
  }
  cv::solve(normal, right, solution, cv::DECOMP_SVD);
  for (int c = 0; c < 3; ++c)
    for (int j = 0; j < 3; ++j)
      m.row[static_cast<std::size_t>(c)][static_cast<std::size_t>(j)] = solution.at<double>(j, c);
  return m;
}

double error_of(const ColourModel& m, const Known& known) {
  return delta_e_2000(lab_of(m.apply(known.patch.code, known.patch.at)), known.lab);
}

std::vector<double> held_out_errors(const ColourModel& m, const std::vector<Known>& known) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < known.size(); ++i) {
    std::vector<Known> others = known;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    errors.push_back(error_of(refined(m, others, kHeldOutRounds), known[i]));
  }
  return errors;
}

double mean(const std::vector<double>& v) {
  double sum = 0;
  for (const double x : v)
    sum += x;
  return sum / static_cast<double>(v.size());
}

/// Codes as if they were Rec. 709, times one factor.
double error_before(const std::vector<Known>& known) {
  double codes = 0, colours = 0, sum = 0;
  for (const Known& k : known) {
    codes += glm::dot(k.patch.code, kLuminance);
    colours += glm::dot(k.colour, kLuminance);
  }
  for (const Known& k : known)
    sum += delta_e_2000(lab_of(k.patch.code * (colours / codes)), k.lab);
  return sum / static_cast<double>(known.size());
}

} // namespace

std::string ColourTerms::name() const {
  return std::string(roots ? "root-polynomial" : "3 x 3 matrix") + (curve ? ", curve" : "") +
         (uneven ? ", uneven light" : "");
}

glm::dvec3 ColourModel::apply(const glm::dvec3& code, const glm::dvec2& at) const {
  const auto f = features(*this, code);
  const double light = terms.uneven ? 1.0 + uneven.x * at.x + uneven.y * at.y : 1.0;
  glm::dvec3 out(0.0);
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t j = 0; j < columns(terms); ++j)
      out[static_cast<int>(c)] += row[c][j] * f[j];
  return out / std::max(light, 0.1);
}

glm::dmat3 ColourModel::matrix() const {
  glm::dmat3 m;
  for (int c = 0; c < 3; ++c)
    for (int j = 0; j < 3; ++j)
      m[j][c] = row[static_cast<std::size_t>(c)][static_cast<std::size_t>(j)];
  return m;
}

Result<ColourFit> fit_colour(const std::array<ChartPatch, kPatches>& patches, const ChartReference& reference,
                             bool linear) {
  std::vector<Known> known;
  std::vector<std::size_t> index;
  for (std::size_t p = 0; p < kPatches; ++p)
    if (!patches[p].saturated) {
      known.push_back({patches[p], reference[p], lab_of(reference[p])});
      index.push_back(p);
    }
  if (known.size() < kFewestPatches)
    return Error{ErrorCode::value_invalid,
                 fmt::format("over-exposed: {} of 24 patches are saturated", kPatches - known.size()), "chart",
                 "expose so that the white patch is below the top of the range"};
  ColourFit fit;
  fit.before = error_before(known);
  double best = INFINITY;
  for (int k = 0; k < 8; ++k) {
    const ColourTerms terms{.curve = (k & 2) != 0, .uneven = (k & 1) != 0, .roots = (k & 4) != 0};
    if (terms.curve && linear)
      continue;
    const ColourModel model = refined(begin(terms, known), known, kRounds);
    const std::vector<double> errors = held_out_errors(model, known);
    fit.tried.push_back({terms.name(), mean(errors)});
    if (mean(errors) >= kBetter * best)
      continue;
    best = fit.held_out = mean(errors);
    fit.model = model;
    fit.patch.fill(-1.0);
    for (std::size_t i = 0; i < known.size(); ++i)
      fit.patch[index[i]] = errors[i];
  }
  double sum = 0;
  for (const Known& k : known)
    sum += error_of(fit.model, k);
  fit.after = sum / static_cast<double>(known.size());
  return fit;
}

bool looks_upside_down(const std::array<ChartPatch, kPatches>& patches, const ChartReference& reference) {
  const auto misfit = [&](bool reversed) {
    std::vector<Known> known;
    for (std::size_t p = 0; p < kPatches; ++p) {
      const std::size_t r = reversed ? kPatches - 1 - p : p;
      known.push_back({patches[p], reference[r], lab_of(reference[r])});
    }
    const ColourModel m = begin({.curve = true, .uneven = false, .roots = false}, known);
    double sum = 0;
    for (const Known& k : known)
      sum += error_of(m, k);
    return sum;
  };
  return misfit(true) < 0.5 * misfit(false);
}

} // namespace daylit::calibration
