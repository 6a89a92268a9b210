#include "radiosity/solve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include <cblas.h>

#include "radiosity/detail/cholesky.h"
#include "radiosity/detail/solve_panel.h"
#include "scene/core/parallel_stage.h"
#include "scene/core/seconds.h"

namespace daylit::radiosity {

namespace {

constexpr int kExpectedIterations = 10;
constexpr std::size_t kPanel = 48; ///< columns per task: wide enough for sgemm, narrow enough for many threads

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

/// Wall and processor time of a solution.
struct Stopwatch {
  double wall = wall_seconds(), cpu = process_seconds();
  void stop(SolveReport& report) const {
    report.seconds = wall_seconds() - wall;
    report.cpu_seconds = process_seconds() - cpu;
  }
};

/// Right sides and solutions of (I - S G S) z = r, [tree position][column], a panel of columns at a time.
struct Columns {
  std::size_t count;
  std::function<void(std::size_t first, std::size_t width, float* right_side)> fill;
  std::function<void(std::size_t first, std::size_t width, const float* solution)> take;
};

Error unsettled(const SolveOptions& options) {
  return {ErrorCode::value_invalid,
          "the light between the walls did not settle in " + std::to_string(options.max_iterations) + " bounces",
          "solve", "reflectances of 1 in a closed room have no solution; lower them"};
}

/// Solves in panels of a fixed width: the bits do not depend on the number of threads. Adds to `report`.
Result<void> solve_columns(const ExchangeMatrix& exchange, const std::vector<float>& scale, const Columns& columns,
                           WorkStore::Name name, const SolveOptions& options, const Progress& progress,
                           SolveReport& report) {
  openblas_set_num_threads(1); // parallel over panels instead
  std::optional<CholeskyFactor> factor;
  if (options.method == SolveMethod::cholesky ||
      (options.method == SolveMethod::automatic &&
       CholeskyFactor::cheaper(exchange, columns.count, kExpectedIterations)))
    factor = CholeskyFactor::of(exchange, scale);
  const std::size_t panels = (columns.count + kPanel - 1) / kPanel;
  SolveReport all;
  all.factorised = factor ? 1 : 0;
  all.residual.resize(columns.count);
  std::vector<int> iterations(panels, 0);
  const Result<void> done = parallel_stage("solve", panels, 1, progress, [&](std::size_t p) {
    const std::size_t first = p * kPanel, width = std::min(kPanel, columns.count - first);
    PanelResult result;
    const WorkStore::Name key{name.stage, name.part, p};
    if (!(options.store && result.take(options.store->find(key), exchange.size() * width, width))) {
      std::vector<float> right_side(exchange.size() * width);
      columns.fill(first, width, right_side.data());
      result = solve_panel(exchange, scale, std::move(right_side), width, options, factor ? &*factor : nullptr);
      if (options.store)
        options.store->keep(key, result.bytes());
    }
    iterations[p] = result.iterations;
    std::ranges::copy(result.residual, all.residual.begin() + static_cast<std::ptrdiff_t>(first));
    columns.take(first, width, result.solution.data());
  });
  if (!done)
    return done.error();
  for (const int i : iterations) {
    if (i < 0)
      return unsettled(options);
    all.iterations = std::max(all.iterations, i);
  }
  for (const float r : all.residual)
    all.worst_residual = std::max(all.worst_residual, static_cast<double>(r));
  report.add(all);
  return {};
}

void copy_channel(Radiosity& out, std::size_t from, std::size_t to) {
  const std::size_t regions = out.columns / 3;
  for (std::size_t i = 0; i < out.patches; ++i)
    std::copy_n(out.b.data() + i * out.columns + from * regions, regions,
                out.b.data() + i * out.columns + to * regions);
}

WorkStore::Name panels_of(WorkStore::Stage stage, int channel) {
  return {stage, static_cast<std::uint32_t>(channel), 0};
}

} // namespace

void SolveReport::add(const SolveReport& other) {
  iterations = std::max(iterations, other.iterations);
  worst_residual = std::max(worst_residual, other.worst_residual);
  residual.insert(residual.end(), other.residual.begin(), other.residual.end());
  factorised += other.factorised;
  channels += other.channels;
  seconds += other.seconds;
  cpu_seconds += other.cpu_seconds;
}

/// Bit-equal reflectances and direct light: the solution is the same.
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

/// With G = A F and z = sqrt(A / rho) B, B = rho (H + F B) becomes z - S G S z = sqrt(rho A) H, S = sqrt(rho / A).
Result<Radiosity> solve_radiosity(const PatchSet& set, const ExchangeMatrix& exchange, const FirstBounce& light,
                                  const SolveOptions& options, const Progress& progress, SolveReport* report) {
  const Stopwatch watch;
  const std::size_t regions = light.columns(), n = set.patches.size();
  Radiosity out{n, 3 * regions, std::vector<float>(n * 3 * regions), equal_channels(set, light)};
  SolveReport done;
  for (int channel = 0; channel < 3; ++channel) {
    const auto c = static_cast<std::size_t>(channel);
    if (out.copy_of[c] != channel) {
      copy_channel(out, static_cast<std::size_t>(out.copy_of[c]), c);
      continue;
    }
    const Scales scales(set, exchange, channel);
    const auto fill = [&](std::size_t first, std::size_t width, float* right_side) {
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t k = 0; k < width; ++k)
          right_side[i * width + k] = scales.times_area[i] * light.row(exchange.order()[i], channel)[first + k];
    };
    const auto take = [&](std::size_t first, std::size_t width, const float* solution) {
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t k = 0; k < width; ++k)
          out.b[exchange.order()[i] * out.columns + c * regions + first + k] =
              solution[i * width + k] * scales.per_area[i];
    };
    const auto solved = solve_columns(exchange, scales.per_area, {regions, fill, take},
                                      panels_of(WorkStore::Stage::forward, channel), options, progress, done);
    if (!solved)
      return solved.error();
    ++done.channels;
  }
  watch.stop(done);
  if (report)
    *report = std::move(done);
  return out;
}

/// w . B = w . S (I - S G S)^-1 sqrt(rho A) H = h . H for h = sqrt(rho A) (I - S G S)^-1 S w: G is symmetric.
Result<std::vector<float>> solve_adjoint(const PatchSet& set, const ExchangeMatrix& exchange,
                                         std::span<const float> weights, std::size_t rows, int channel,
                                         const SolveOptions& options, const Progress& progress, SolveReport* report) {
  const Stopwatch watch;
  const std::size_t n = set.patches.size();
  if (weights.size() != n * rows)
    return Error{ErrorCode::value_invalid, "the weights are not rows of one value per patch", "adjoint solve", ""};
  std::vector<float> result(rows * n);
  SolveReport done;
  const Scales scales(set, exchange, channel);
  const auto fill = [&](std::size_t first, std::size_t width, float* right_side) {
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < width; ++k)
        right_side[i * width + k] = scales.per_area[i] * weights[(first + k) * n + exchange.order()[i]];
  };
  const auto take = [&](std::size_t first, std::size_t width, const float* solution) {
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < width; ++k)
        result[(first + k) * n + exchange.order()[i]] = solution[i * width + k] * scales.times_area[i];
  };
  const auto solved = solve_columns(exchange, scales.per_area, {rows, fill, take},
                                    panels_of(WorkStore::Stage::adjoint, channel), options, progress, done);
  if (!solved)
    return solved.error();
  done.channels = 1;
  watch.stop(done);
  if (report)
    *report = std::move(done);
  return result;
}

} // namespace daylit::radiosity
