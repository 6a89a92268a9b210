#include "radiosity/solve.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>

#include <cblas.h>
#include <tbb/parallel_for.h>

namespace daylit::radiosity {

namespace {

constexpr std::size_t kPanel = 48; ///< columns per task: wide enough for sgemm, narrow enough to share out

/// A range of columns of one problem, all of them iterated together, each with its own step lengths.
/// Vectors are in the tree order of the matrix.
class Panel {
public:
  Panel(const ElementSet& set, const ExchangeMatrix& exchange, const FirstBounce& light, std::size_t first,
        std::size_t width)
      : n_(set.elements.size()), width_(width), exchange_(exchange), scale_(n_ * width), x_(n_ * width, 0.0f),
        r_(n_ * width), p_(n_ * width), q_(n_ * width), work_(n_ * width) {
    const std::size_t regions = light.columns();
    for (std::size_t i = 0; i < n_; ++i)
      for (std::size_t k = 0; k < width; ++k) {
        const auto channel = static_cast<int>((first + k) / regions);
        const std::size_t element = exchange.order()[i];
        const Element& e = set.elements[element];
        const double rho = static_cast<double>(e.reflectance[channel]);
        scale_[i * width + k] = static_cast<float>(std::sqrt(rho / e.area_m2));
        r_[i * width + k] =
            static_cast<float>(std::sqrt(rho * e.area_m2)) * light.row(element, channel)[(first + k) % regions];
      }
    p_ = r_;
    right_side_ = r_;
  }

  /// Returns the iterations used, -1 when the limit was met first.
  int iterate(const SolveOptions& options) {
    std::vector<double> start = dots(r_, r_), rr = start;
    const double limit2 = options.tolerance * options.tolerance;
    for (int it = 0; it < options.max_iterations; ++it) {
      bool all_done = true;
      for (std::size_t k = 0; k < width_; ++k)
        all_done = all_done && rr[k] <= limit2 * start[k];
      if (all_done)
        return it;
      step(rr, start, limit2);
    }
    return -1;
  }

  /// Largest relative residual, from the definition.
  double worst_residual() {
    apply(x_, q_);
    for (std::size_t i = 0; i < q_.size(); ++i)
      q_[i] = right_side_[i] - q_[i];
    const std::vector<double> residual = dots(q_, q_), start = dots(right_side_, right_side_);
    double worst = 0;
    for (std::size_t k = 0; k < width_; ++k)
      if (start[k] > 0)
        worst = std::max(worst, std::sqrt(residual[k] / start[k]));
    return worst;
  }

  void write(Radiosity& out, std::size_t first) const {
    for (std::size_t i = 0; i < n_; ++i)
      for (std::size_t k = 0; k < width_; ++k)
        out.b[exchange_.order()[i] * out.columns + first + k] = x_[i * width_ + k] * scale_[i * width_ + k];
  }

private:
  /// out = v - D^-1/2 G D^-1/2 v
  void apply(const std::vector<float>& v, std::vector<float>& out) {
    for (std::size_t i = 0; i < v.size(); ++i)
      work_[i] = v[i] * scale_[i];
    exchange_.multiply(work_.data(), width_, out.data());
    for (std::size_t i = 0; i < v.size(); ++i)
      out[i] = v[i] - out[i] * scale_[i];
  }

  std::vector<double> dots(const std::vector<float>& a, const std::vector<float>& b) const {
    std::vector<double> sum(width_, 0.0);
    for (std::size_t i = 0; i < n_; ++i)
      for (std::size_t k = 0; k < width_; ++k)
        sum[k] += static_cast<double>(a[i * width_ + k]) * static_cast<double>(b[i * width_ + k]);
    return sum;
  }

  /// One conjugate gradient step; columns that are done stand still.
  void step(std::vector<double>& rr, const std::vector<double>& start, double limit2) {
    apply(p_, q_);
    const std::vector<double> pq = dots(p_, q_);
    std::vector<float> alpha(width_, 0.0f), beta(width_, 0.0f);
    for (std::size_t k = 0; k < width_; ++k)
      if (rr[k] > limit2 * start[k] && pq[k] > 0)
        alpha[k] = static_cast<float>(rr[k] / pq[k]);
    for (std::size_t i = 0; i < n_; ++i)
      for (std::size_t k = 0; k < width_; ++k) {
        x_[i * width_ + k] += alpha[k] * p_[i * width_ + k];
        r_[i * width_ + k] -= alpha[k] * q_[i * width_ + k];
      }
    const std::vector<double> next = dots(r_, r_);
    for (std::size_t k = 0; k < width_; ++k) {
      beta[k] = rr[k] > 0 ? static_cast<float>(next[k] / rr[k]) : 0.0f;
      rr[k] = next[k];
    }
    for (std::size_t i = 0; i < n_; ++i)
      for (std::size_t k = 0; k < width_; ++k)
        p_[i * width_ + k] = r_[i * width_ + k] + beta[k] * p_[i * width_ + k];
  }

  std::size_t n_, width_;
  const ExchangeMatrix& exchange_;
  std::vector<float> scale_, x_, r_, p_, q_, work_, right_side_;
};

} // namespace

Result<Radiosity> solve_radiosity(const ElementSet& set, const ExchangeMatrix& exchange, const FirstBounce& light,
                                  const SolveOptions& options, const Progress& progress, SolveReport* report) {
  const auto start = std::chrono::steady_clock::now();
  openblas_set_num_threads(1); // parallel over panels instead: same bits for any number of threads
  Radiosity out;
  out.elements = set.elements.size();
  out.columns = 3 * light.columns();
  out.b.assign(out.elements * out.columns, 0.0f);
  const std::size_t panels = (out.columns + kPanel - 1) / kPanel;
  std::vector<int> iterations(panels, 0);
  std::vector<double> residual(panels, 0.0);
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
  tbb::parallel_for(std::size_t{0}, panels, [&](std::size_t p) {
    if (stop)
      return;
    const std::size_t first = p * kPanel, width = std::min(kPanel, out.columns - first);
    Panel panel(set, exchange, light, first, width);
    iterations[p] = panel.iterate(options);
    residual[p] = panel.worst_residual();
    panel.write(out, first);
    if (!progress("solve", static_cast<double>(++done) / static_cast<double>(panels)))
      stop = true;
  });
  if (stop)
    return interrupted_error("solve");
  if (std::ranges::any_of(iterations, [](int i) { return i < 0; }))
    return Error{ErrorCode::value_invalid,
                 "the light between the walls did not settle in " + std::to_string(options.max_iterations) + " bounces",
                 "solve", "reflectances of 1 in a closed room have no solution; lower them"};
  if (report)
    *report = {iterations.empty() ? 0 : *std::ranges::max_element(iterations),
               residual.empty() ? 0.0 : *std::ranges::max_element(residual),
               std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()};
  return out;
}

namespace {

/// Per element: what the others send it per unit of radiosity (row sum of G), and how much of what it sends them they
/// absorb, per channel; m^2. G is symmetric, so four products serve any number of columns.
std::vector<std::array<float, 4>> absorbed_by_others(const ElementSet& set, const ExchangeMatrix& exchange) {
  const std::size_t n = set.elements.size();
  std::vector<std::array<float, 4>> weight(n), product(n), result(n);
  for (std::size_t k = 0; k < n; ++k) {
    const Rgb& rho = set.elements[exchange.order()[k]].reflectance;
    weight[k] = {1.0f - rho[0], 1.0f - rho[1], 1.0f - rho[2], 1.0f};
  }
  if (n > 0)
    exchange.multiply(weight[0].data(), 4, product[0].data());
  for (std::size_t k = 0; k < n; ++k)
    result[exchange.order()[k]] = product[k];
  return result;
}

} // namespace

EnergyBalance audit_energy(const ElementSet& set, const ExchangeMatrix& exchange, const FirstBounce& light,
                           const Radiosity& radiosity) {
  EnergyBalance balance;
  const std::size_t regions = light.columns();
  const auto others = absorbed_by_others(set, exchange);
  double area = 0;
  for (std::size_t i = 0; i < set.elements.size(); ++i) {
    const Element& e = set.elements[i];
    const double opening = static_cast<double>(light.opening[i]);
    const double closure = static_cast<double>(others[i][3]) / e.area_m2 + opening - 1.0;
    balance.worst_closure = std::max(balance.worst_closure, std::abs(closure));
    balance.mean_closure += closure * e.area_m2;
    area += e.area_m2;
    for (std::size_t k = 0; k < radiosity.columns; ++k) {
      const std::size_t channel = k / regions;
      const auto c = static_cast<int>(channel);
      const double direct = e.area_m2 * static_cast<double>(light.row(i, c)[k % regions]);
      const double b = static_cast<double>(radiosity.row(i)[k]);
      balance.entering += direct;
      balance.absorbed +=
          (1.0 - static_cast<double>(e.reflectance[c])) * direct + static_cast<double>(others[i][channel]) * b;
      balance.leaving += e.area_m2 * b * opening;
    }
  }
  balance.mean_closure = area > 0 ? balance.mean_closure / area : 0.0;
  balance.imbalance =
      balance.entering > 0 ? std::abs(balance.entering - balance.absorbed - balance.leaving) / balance.entering : 0.0;
  return balance;
}

} // namespace daylit::radiosity
