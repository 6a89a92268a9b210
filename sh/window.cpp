#include "sh/window.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "sh/basis.h"
#include "sh/detail/check.h"
#include "sh/transform.h"

namespace daylit::sh {
namespace {

constexpr double kPi = std::numbers::pi;

Expected<int> degree_of(std::size_t count, const char* where) {
  const int degree = int(std::lround(std::sqrt(double(count)))) - 1;
  if (degree < 0 || std::size_t(degree + 1) * std::size_t(degree + 1) != count)
    return Error{ErrorCode::wrong_count, std::to_string(count) + " coefficients are not a square number", where};
  return degree;
}

Expected<void> check_cutoff(int degree, double cutoff, const char* where) {
  if (const auto ok = detail::check_degree(degree, where); !ok)
    return ok;
  if (!(cutoff > 0.0) || !std::isfinite(cutoff))
    return Error{ErrorCode::parameter_out_of_range, "cutoff must be positive", where};
  return {};
}

/// Eigenvalues and eigenvectors (columns of v) of a symmetric 3 x 3 matrix by Jacobi rotations.
void eigen3(double a[3][3], double v[3][3]) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      v[i][j] = i == j ? 1.0 : 0.0;
  for (int sweep = 0; sweep < 30; ++sweep)
    for (const auto [p, q] : {std::array{0, 1}, std::array{0, 2}, std::array{1, 2}}) {
      if (a[p][q] == 0.0)
        continue;
      const double angle = 0.5 * std::atan2(2.0 * a[p][q], a[q][q] - a[p][p]);
      const double c = std::cos(angle), s = std::sin(angle);
      for (int k = 0; k < 3; ++k) {
        const double x = a[k][p], y = a[k][q];
        a[k][p] = c * x - s * y;
        a[k][q] = s * x + c * y;
      }
      for (int k = 0; k < 3; ++k) {
        const double x = a[p][k], y = a[q][k], vx = v[k][p], vy = v[k][q];
        a[p][k] = c * x - s * y;
        a[q][k] = s * x + c * y;
        v[k][p] = c * vx - s * vy;
        v[k][q] = s * vx + c * vy;
      }
      a[p][q] = a[q][p] = 0.0;
    }
}

/// Minimum over the unit sphere of n.Mn + b.n. With M = V diag(e) V^T and g = V^T b a minimiser satisfies
/// (e_i - mu) n_i = -g_i / 2 with mu <= min e; |n| = 1 fixes mu. Where g vanishes along the smallest eigenvector that
/// component of n is free ("hard case") and mu = min e.
Extremum minimum_of_quadratic(double m[3][3], const double b[3]) {
  double v[3][3];
  eigen3(m, v);
  double e[3], g[3], scale = 1e-300;
  for (int i = 0; i < 3; ++i) {
    e[i] = m[i][i];
    g[i] = b[0] * v[0][i] + b[1] * v[1][i] + b[2] * v[2][i];
    scale = std::max({scale, std::abs(e[i]), std::abs(g[i])});
  }
  const int low = int(std::min_element(e, e + 3) - e);
  const auto length2 = [&](double mu) {
    double sum = 0.0;
    for (int i = 0; i < 3; ++i)
      if (g[i] != 0.0)
        sum += 0.25 * g[i] * g[i] / ((e[i] - mu) * (e[i] - mu));
    return sum;
  };
  double near = 0.0, far = 2.0 * scale; // distance of mu below the smallest eigenvalue
  for (int step = 0; step < 200 && near < far; ++step) {
    const double middle = 0.5 * (near + far);
    if (middle == near || middle == far)
      break;
    (length2(e[low] - middle) > 1.0 ? near : far) = middle;
  }
  const double mu = e[low] - far;
  double n[3], rest = 1.0;
  for (int i = 0; i < 3; ++i) {
    n[i] = e[i] - mu > 1e-15 * scale ? -0.5 * g[i] / (e[i] - mu) : 0.0;
    if (i != low)
      rest -= n[i] * n[i];
  }
  n[low] = std::copysign(std::sqrt(std::max(0.0, rest)), g[low] == 0.0 ? 1.0 : -g[low]);
  Extremum result{0.0, {}};
  for (int i = 0; i < 3; ++i) {
    result.value += (e[i] * n[i] + g[i]) * n[i];
    for (int k = 0; k < 3; ++k)
      result.direction[k] += v[k][i] * n[i];
  }
  return result;
}

Extremum minimum_to_degree_2(std::span<const double> c) {
  // n.Mn + b.n from the closed forms of sh9.h, the constant written as c |n|^2.
  constexpr double c0 = 0.28209479177387814347, c1 = 0.48860251190291992159, c2 = 1.09254843059207907054,
                   c20 = 0.31539156525252000603, c22 = 0.54627421529603953527;
  std::array<double, 9> f{};
  std::copy(c.begin(), c.end(), f.begin());
  const double constant = c0 * f[0] - c20 * f[6];
  double m[3][3] = {{constant + c22 * f[8], 0.5 * c2 * f[4], 0.5 * c2 * f[7]},
                    {0.5 * c2 * f[4], constant - c22 * f[8], 0.5 * c2 * f[5]},
                    {0.5 * c2 * f[7], 0.5 * c2 * f[5], constant + 3.0 * c20 * f[6]}};
  const double b[3] = {c1 * f[3], c1 * f[1], c1 * f[2]};
  return minimum_of_quadratic(m, b);
}

double value_at(std::span<const double> c, int degree, const glm::dvec3& n, std::vector<double>& basis) {
  basis.resize(c.size());
  if (!evaluate(degree, n, basis))
    return 0.0;
  double sum = 0.0;
  for (std::size_t i = 0; i < c.size(); ++i)
    sum += c[i] * basis[i];
  return sum;
}

/// Pattern search on the sphere: halves the step until it is far below the wavelength.
Extremum refine(std::span<const double> c, int degree, glm::dvec3 n, double step) {
  std::vector<double> basis;
  double value = value_at(c, degree, n, basis);
  for (; step > 1e-7 / degree; step *= 0.5)
    for (bool moved = true; moved;) {
      moved = false;
      const glm::dvec3 helper = std::abs(n.z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
      const glm::dvec3 u = glm::normalize(glm::cross(helper, n)), w = glm::cross(n, u);
      for (const auto& t : {u, -u, w, -w}) {
        const glm::dvec3 trial = glm::normalize(n + step * t);
        if (const double v = value_at(c, degree, trial, basis); v < value) {
          value = v;
          n = trial;
          moved = true;
          break;
        }
      }
    }
  return {value, {n.x, n.y, n.z}};
}

Expected<Extremum> minimum_by_grid(std::span<const double> c, int degree) {
  const auto grid = gauss_legendre_grid(4 * degree);
  if (!grid)
    return grid.error();
  auto transform = RingTransform::create(*grid, degree);
  if (!transform)
    return transform.error();
  std::vector<double> image(grid->samples());
  if (const auto ok = transform->synthesise(c, interleaved(image.data(), grid->longitudes, 1)); !ok)
    return ok.error();
  std::vector<std::size_t> order(image.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    order[i] = i;
  const std::size_t tries = std::min<std::size_t>(12, order.size());
  std::partial_sort(order.begin(), order.begin() + std::ptrdiff_t(tries), order.end(),
                    [&](std::size_t a, std::size_t b) { return image[a] < image[b]; });
  Extremum best{image[order[0]], {}};
  for (std::size_t k = 0; k < tries; ++k) {
    const std::size_t ring = order[k] / std::size_t(grid->longitudes), j = order[k] % std::size_t(grid->longitudes);
    const double phi = 2.0 * kPi * double(j) / grid->longitudes, s = grid->sin_theta[ring];
    const Extremum found =
        refine(c, degree, {s * std::cos(phi), s * std::sin(phi), grid->cos_theta[ring]}, 0.5 / degree);
    if (k == 0 || found.value < best.value)
      best = found;
  }
  return best;
}

std::vector<double> windowed(std::span<const double> window, std::span<const double> c) {
  std::vector<double> out(c.begin(), c.end());
  for (std::size_t l = 0; l < window.size(); ++l)
    for (std::size_t i = l * l; i < (l + 1) * (l + 1); ++i)
      out[i] *= window[l];
  return out;
}

std::vector<double> laplacian_window(int degree, double strength) {
  std::vector<double> w;
  for (int l = 0; l <= degree; ++l)
    w.push_back(1.0 / (1.0 + strength * double(l) * l * (l + 1.0) * (l + 1.0)));
  return w;
}

} // namespace

Expected<std::vector<double>> hann_window(int degree, double cutoff) {
  if (const auto ok = check_cutoff(degree, cutoff, "hann_window"); !ok)
    return ok.error();
  std::vector<double> w;
  for (int l = 0; l <= degree; ++l)
    w.push_back(l < cutoff ? 0.5 * (1.0 + std::cos(kPi * l / cutoff)) : 0.0);
  return w;
}

Expected<std::vector<double>> lanczos_window(int degree, double cutoff) {
  if (const auto ok = check_cutoff(degree, cutoff, "lanczos_window"); !ok)
    return ok.error();
  std::vector<double> w;
  for (int l = 0; l <= degree; ++l) {
    const double x = kPi * l / cutoff;
    w.push_back(l == 0 ? 1.0 : (l < cutoff ? std::sin(x) / x : 0.0));
  }
  return w;
}

Expected<WindowBias> window_bias(std::span<const double> window, std::span<const double> coefficients) {
  if (const auto ok =
          detail::check_count(coefficients.size(), window.size() * window.size(), "coefficients", "window_bias");
      !ok)
    return ok.error();
  double all = 0.0, kept = 0.0, changed = 0.0;
  WindowBias bias;
  for (std::size_t l = 0; l < window.size(); ++l) {
    double band = 0.0;
    for (std::size_t i = l * l; i < (l + 1) * (l + 1); ++i)
      band += coefficients[i] * coefficients[i];
    const double off = 1.0 - window[l];
    all += band;
    kept += window[l] * window[l] * band;
    changed += off * off * band;
    bias.max_change += std::abs(off) * std::sqrt((2.0 * double(l) + 1.0) / (4.0 * kPi) * band);
  }
  bias.energy_kept = all > 0.0 ? kept / all : 1.0;
  bias.rms_change = std::sqrt(changed / (4.0 * kPi));
  return bias;
}

Expected<Extremum> minimum_on_sphere(std::span<const double> coefficients) {
  const auto degree = degree_of(coefficients.size(), "minimum_on_sphere");
  if (!degree)
    return degree.error();
  if (const auto ok = detail::check_degree(*degree, "minimum_on_sphere", kMaxWindowDegree); !ok)
    return ok.error();
  if (const auto ok = detail::check_finite<double>(coefficients, "coefficient", "minimum_on_sphere"); !ok)
    return ok.error();
  return *degree <= 2 ? minimum_to_degree_2(coefficients) : minimum_by_grid(coefficients, *degree);
}

Expected<NonNegativeWindow> nonnegative_window(std::span<const double> coefficients) {
  const auto before = minimum_on_sphere(coefficients);
  if (!before)
    return before.error();
  if (coefficients[0] < 0.0)
    return Error{ErrorCode::parameter_out_of_range, "the mean is negative, no window can help", "nonnegative_window"};
  const int degree = *degree_of(coefficients.size(), "nonnegative_window");
  NonNegativeWindow result;
  result.bands = laplacian_window(degree, 0.0);
  result.minimum_before = result.minimum_after = before->value;
  const auto minimum_at = [&](double strength) -> double {
    const auto m = minimum_on_sphere(windowed(laplacian_window(degree, strength), coefficients));
    return m ? m->value : -1.0;
  };
  if (before->value < 0.0 && coefficients[0] == 0.0) {
    result.bands.assign(result.bands.size(), 0.0);
    result.minimum_after = 0.0;
    result.strength = std::numeric_limits<double>::infinity();
  } else if (before->value < 0.0) {
    double low = 0.0, high = 1e-6;
    while (minimum_at(high) < 0.0 && high < 1e18) {
      low = high;
      high *= 4.0;
    }
    for (int step = 0; step < 50 && high - low > 1e-9 * high; ++step) {
      const double middle = 0.5 * (low + high);
      (minimum_at(middle) < 0.0 ? low : high) = middle;
    }
    result.strength = high;
    result.bands = laplacian_window(degree, high);
    result.minimum_after = minimum_at(high);
  }
  const auto bias = window_bias(result.bands, coefficients);
  if (!bias)
    return bias.error();
  result.bias = *bias;
  return result;
}

} // namespace daylit::sh
