#include "radiosity/solve.h"

#include "radiosity/detail/cholesky.h"
#include "scene/core/parallel.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <optional>
#include <span>

#include <cblas.h>

#include "scene/core/seconds.h"

namespace daylit::radiosity {

namespace {

constexpr int kExpectedIterations = 10;
constexpr std::size_t kPanel = 48; ///< columns per task: wide enough for sgemm, narrow enough to share out

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

  /// Relative residual of each column, from the definition.
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

/// sqrt(rho / A) and sqrt(rho A) per tree position.
struct Scales {
  std::vector<float> per_area, times_area;
  Scales(const PatchSet& set, const ExchangeMatrix& exchange, int channel) {
    for (const std::uint32_t patch : exchange.order()) {
      const double rho = static_cast<double>(set.patches[patch].reflectance[channel]);
      per_area.push_back(static_cast<float>(std::sqrt(rho / set.patches[patch].area_m2)));
      times_area.push_back(static_cast<float>(std::sqrt(rho * set.patches[patch].area_m2)));
    }
  }
};

/// What one panel leaves behind.
struct PanelResult {
  std::int32_t iterations = -1;
  std::vector<float> residual, solution;

  std::vector<std::byte> bytes() const {
    std::vector<float> all = {static_cast<float>(iterations)};
    all.insert(all.end(), residual.begin(), residual.end());
    all.insert(all.end(), solution.begin(), solution.end());
    const auto raw = std::as_bytes(std::span(all));
    return {raw.begin(), raw.end()};
  }
  bool take(const std::optional<std::vector<std::byte>>& raw, std::size_t values, std::size_t width) {
    if (!raw || raw->size() != (1 + width + values) * sizeof(float))
      return false;
    std::vector<float> all(1 + width + values);
    std::memcpy(all.data(), raw->data(), raw->size());
    iterations = static_cast<std::int32_t>(all[0]);
    residual.assign(all.begin() + 1, all.begin() + 1 + static_cast<std::ptrdiff_t>(width));
    solution.assign(all.begin() + 1 + static_cast<std::ptrdiff_t>(width), all.end());
    return true;
  }
};

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

/// Solves `columns` columns in panels of a fixed width: the bits do not depend on the number of threads.
/// `enter(first, width, right_side)` fills a panel, `leave(first, width, solution)` takes its solution.
template <class Enter, class Leave>
Result<void> in_panels(const ExchangeMatrix& exchange, const std::vector<float>& scale, std::size_t columns,
                       WorkStore::Name name, const SolveOptions& options, const Progress& progress, SolveReport& report,
                       const Enter& enter, const Leave& leave) {
  openblas_set_num_threads(1); // parallel over panels instead
  std::optional<CholeskyFactor> factor;
  if (options.method == SolveMethod::cholesky ||
      (options.method == SolveMethod::automatic && CholeskyFactor::cheaper(exchange, columns, kExpectedIterations)))
    factor = CholeskyFactor::of(exchange, scale);
  report.factorised += factor ? 1 : 0;
  const std::size_t panels = (columns + kPanel - 1) / kPanel, before = report.residual.size();
  report.residual.resize(before + columns);
  std::vector<int> iterations(panels, 0);
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
  parallel_for(std::size_t{0}, panels, [&](std::size_t p) {
    if (stop)
      return;
    const std::size_t first = p * kPanel, width = std::min(kPanel, columns - first);
    PanelResult result;
    const WorkStore::Name piece{name.stage, name.part, p};
    if (!(options.store && result.take(options.store->find(piece), exchange.size() * width, width))) {
      std::vector<float> right_side(exchange.size() * width);
      enter(first, width, right_side.data());
      result = solve_panel(exchange, scale, std::move(right_side), width, options, factor ? &*factor : nullptr);
      if (options.store)
        options.store->keep(piece, result.bytes());
    }
    iterations[p] = result.iterations;
    std::ranges::copy(result.residual, report.residual.begin() + static_cast<std::ptrdiff_t>(before + first));
    leave(first, width, result.solution.data());
    if (!progress("solve", static_cast<double>(++done) / static_cast<double>(panels)))
      stop = true;
  });
  if (stop)
    return interrupted_error("solve");
  for (const int i : iterations) {
    if (i < 0)
      return Error{ErrorCode::value_invalid,
                   "the light between the walls did not settle in " + std::to_string(options.max_iterations) +
                       " bounces",
                   "solve", "reflectances of 1 in a closed room have no solution; lower them"};
    report.iterations = std::max(report.iterations, i);
  }
  for (const float r : report.residual)
    report.worst_residual = std::max(report.worst_residual, static_cast<double>(r));
  return {};
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void copy_channel(Radiosity& out, std::size_t from, std::size_t to) {
  const std::size_t regions = out.columns / 3;
  for (std::size_t i = 0; i < out.patches; ++i)
    std::copy_n(out.b.data() + i * out.columns + from * regions, regions,
                out.b.data() + i * out.columns + to * regions);
}

} // namespace

std::array<int, 3> equal_channels(const PatchSet& set, const FirstBounce& light) {
  std::array<int, 3> copy_of = {0, 1, 2};
  for (int c = 1; c < 3; ++c)
    for (int d = 0; d < c && copy_of[static_cast<std::size_t>(c)] == c; ++d) {
      bool equal = true;
      for (std::size_t i = 0; i < set.patches.size() && equal; ++i)
        equal = set.patches[i].reflectance[c] == set.patches[i].reflectance[d] &&
                std::equal(light.row(i, c), light.row(i, c) + light.columns(), light.row(i, d));
      if (equal)
        copy_of[static_cast<std::size_t>(c)] = d;
    }
  return copy_of;
}

Result<Radiosity> solve_radiosity(const PatchSet& set, const ExchangeMatrix& exchange, const FirstBounce& light,
                                  const SolveOptions& options, const Progress& progress, SolveReport* report) {
  const auto start = std::chrono::steady_clock::now();
  const double cpu_start = process_seconds();
  const std::size_t regions = light.columns(), n = set.patches.size();
  Radiosity out{n, 3 * regions, std::vector<float>(n * 3 * regions), equal_channels(set, light)};
  SolveReport done;
  done.channels = 0;
  for (int channel = 0; channel < 3; ++channel) {
    const auto c = static_cast<std::size_t>(channel);
    if (out.copy_of[c] != channel) {
      copy_channel(out, static_cast<std::size_t>(out.copy_of[c]), c);
      continue;
    }
    const Scales scales(set, exchange, channel);
    const auto enter = [&](std::size_t first, std::size_t width, float* right_side) {
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t k = 0; k < width; ++k)
          right_side[i * width + k] = scales.times_area[i] * light.row(exchange.order()[i], channel)[first + k];
    };
    const auto leave = [&](std::size_t first, std::size_t width, const float* solution) {
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t k = 0; k < width; ++k)
          out.b[exchange.order()[i] * out.columns + c * regions + first + k] =
              solution[i * width + k] * scales.per_area[i];
    };
    const auto solved = in_panels(exchange, scales.per_area, regions,
                                  {WorkStore::Stage::forward, static_cast<std::uint32_t>(channel), 0}, options,
                                  progress, done, enter, leave);
    if (!solved)
      return solved.error();
    ++done.channels;
  }
  done.seconds = seconds_since(start);
  done.cpu_seconds = process_seconds() - cpu_start;
  if (report)
    *report = std::move(done);
  return out;
}

Result<std::vector<float>> solve_adjoint(const PatchSet& set, const ExchangeMatrix& exchange,
                                         std::span<const float> weights, std::size_t rows, int channel,
                                         const SolveOptions& options, const Progress& progress, SolveReport* report) {
  const auto start = std::chrono::steady_clock::now();
  const double cpu_start = process_seconds();
  const std::size_t n = set.patches.size();
  if (weights.size() != n * rows)
    return Error{ErrorCode::value_invalid, "the weights are not rows of one value per patch", "adjoint solve", ""};
  std::vector<float> result(rows * n);
  SolveReport done;
  done.channels = 1;
  const Scales scales(set, exchange, channel);
  const auto enter = [&](std::size_t first, std::size_t width, float* right_side) {
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < width; ++k)
        right_side[i * width + k] = scales.per_area[i] * weights[(first + k) * n + exchange.order()[i]];
  };
  const auto leave = [&](std::size_t first, std::size_t width, const float* solution) {
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < width; ++k)
        result[(first + k) * n + exchange.order()[i]] = solution[i * width + k] * scales.times_area[i];
  };
  const auto solved =
      in_panels(exchange, scales.per_area, rows, {WorkStore::Stage::adjoint, static_cast<std::uint32_t>(channel), 0},
                options, progress, done, enter, leave);
  if (!solved)
    return solved.error();
  done.seconds = seconds_since(start);
  done.cpu_seconds = process_seconds() - cpu_start;
  if (report)
    *report = std::move(done);
  return result;
}

namespace {

/// Per patch and channel: how much of what it sends the others they absorb, per unit of its radiosity; m^2. G is
/// symmetric, so three products serve any number of columns.
std::vector<std::array<float, 3>> absorbed_by_others(const PatchSet& set, const ExchangeMatrix& exchange) {
  const std::size_t n = set.patches.size();
  std::vector<std::array<float, 3>> weight(n), product(n), result(n);
  for (std::size_t k = 0; k < n; ++k) {
    const Rgb& rho = set.patches[exchange.order()[k]].reflectance;
    weight[k] = {1.0f - rho[0], 1.0f - rho[1], 1.0f - rho[2]};
  }
  if (n > 0)
    exchange.multiply(weight[0].data(), 3, product[0].data());
  for (std::size_t k = 0; k < n; ++k)
    result[exchange.order()[k]] = product[k];
  return result;
}

} // namespace

EnergyBalance audit_energy(const PatchSet& set, const ExchangeMatrix& exchange, const FirstBounce& light,
                           const Radiosity& radiosity, const RowClosure* closed) {
  EnergyBalance balance;
  const std::size_t regions = light.columns();
  const auto others = absorbed_by_others(set, exchange);
  double unclosed = 0;
  for (std::size_t i = 0; i < set.patches.size(); ++i) {
    const Patch& e = set.patches[i];
    const double opening = static_cast<double>(light.opening[i]);
    const double gain = closed ? e.area_m2 * static_cast<double>(closed->deviation[i]) : 0.0;
    for (std::size_t k = 0; k < radiosity.columns; ++k) {
      const std::size_t channel = k / regions;
      const auto c = static_cast<int>(channel);
      const double direct = e.area_m2 * static_cast<double>(light.row(i, c)[k % regions]);
      const double b = static_cast<double>(radiosity.row(i)[k]);
      balance.entering += direct;
      balance.absorbed +=
          (1.0 - static_cast<double>(e.reflectance[c])) * direct + static_cast<double>(others[i][channel]) * b;
      balance.leaving += e.area_m2 * b * opening;
      unclosed += gain * b;
    }
  }
  if (balance.entering > 0) {
    balance.imbalance = std::abs(balance.entering - balance.absorbed - balance.leaving) / balance.entering;
    balance.unclosed = std::abs(unclosed) / balance.entering;
  }
  return balance;
}

} // namespace daylit::radiosity
