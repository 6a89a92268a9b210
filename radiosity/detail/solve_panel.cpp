#include "radiosity/detail/solve_panel.h"

#include <cmath>
#include <cstring>
#include <span>

namespace daylit::radiosity {

namespace {

/// Columns of one problem z - S G S z = r, all of them iterated together, each with its own step lengths. Vectors are
/// in the tree order of the matrix, [position][column].
class Panel {
public:
  /// `scale`: the diagonal S = sqrt(rho / A) per position.
  Panel(const ExchangeMatrix& exchange, std::vector<float> scale, std::vector<float> right_side, std::size_t width)
      : n_(exchange.size()), width_(width), exchange_(exchange), scale_(std::move(scale)), x_(n_ * width, 0.0f),
        r_(std::move(right_side)), p_(r_), q_(n_ * width), work_(n_ * width), right_side_(r_) {}

  /// By a factor of the same problem.
  void solve(const CholeskyFactor& factor) {
    x_ = right_side_;
    factor.solve(x_.data(), width_);
  }

  /// Conjugate gradients (Hestenes & Stiefel 1952) for every column until |r| <= tolerance |r_0|. Returns the
  /// iterations used, -1 when the limit was met first.
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

  /// Relative residual |r - (z - S G S z)| / |r| of each column, from the definition.
  void residuals(float* out) {
    apply(x_, q_);
    for (std::size_t i = 0; i < q_.size(); ++i)
      q_[i] = right_side_[i] - q_[i];
    const std::vector<double> residual = dots(q_, q_), start = dots(right_side_, right_side_);
    for (std::size_t k = 0; k < width_; ++k)
      out[k] = start[k] > 0 ? static_cast<float>(std::sqrt(residual[k] / start[k])) : 0.0f;
  }

  const std::vector<float>& solution() const { return x_; }

private:
  /// out = v - S G S v
  void apply(const std::vector<float>& v, std::vector<float>& out) {
    for (std::size_t i = 0; i < n_; ++i)
      for (std::size_t k = 0; k < width_; ++k)
        work_[i * width_ + k] = v[i * width_ + k] * scale_[i];
    exchange_.multiply(work_.data(), width_, out.data());
    for (std::size_t i = 0; i < n_; ++i)
      for (std::size_t k = 0; k < width_; ++k)
        out[i * width_ + k] = v[i * width_ + k] - out[i * width_ + k] * scale_[i];
  }

  std::vector<double> dots(const std::vector<float>& a, const std::vector<float>& b) const {
    std::vector<double> sum(width_, 0.0);
    for (std::size_t i = 0; i < n_; ++i)
      for (std::size_t k = 0; k < width_; ++k)
        sum[k] += static_cast<double>(a[i * width_ + k]) * static_cast<double>(b[i * width_ + k]);
    return sum;
  }

  /// alpha = r.r / p.Ap, x += alpha p, r -= alpha Ap, beta = r'.r' / r.r, p = r' + beta p; columns that are done stand
  /// still (alpha = 0).
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

std::vector<std::byte> PanelResult::bytes() const {
  std::vector<float> all = {static_cast<float>(iterations)};
  all.insert(all.end(), residual.begin(), residual.end());
  all.insert(all.end(), solution.begin(), solution.end());
  const auto raw = std::as_bytes(std::span(all));
  return {raw.begin(), raw.end()};
}

bool PanelResult::take(const std::optional<std::vector<std::byte>>& raw, std::size_t values, std::size_t width) {
  if (!raw || raw->size() != (1 + width + values) * sizeof(float))
    return false;
  std::vector<float> all(1 + width + values);
  std::memcpy(all.data(), raw->data(), raw->size());
  iterations = static_cast<std::int32_t>(all[0]);
  residual.assign(all.begin() + 1, all.begin() + 1 + static_cast<std::ptrdiff_t>(width));
  solution.assign(all.begin() + 1 + static_cast<std::ptrdiff_t>(width), all.end());
  return true;
}

PanelResult solve_panel(const ExchangeMatrix& exchange, const std::vector<float>& scale, std::vector<float> right_side,
                        std::size_t width, const SolveOptions& options, const CholeskyFactor* factor) {
  Panel panel(exchange, scale, std::move(right_side), width);
  PanelResult result;
  result.iterations = 0;
  if (factor)
    panel.solve(*factor);
  else
    result.iterations = panel.iterate(options);
  result.residual.resize(width);
  panel.residuals(result.residual.data());
  result.solution = panel.solution();
  return result;
}

} // namespace daylit::radiosity
