#include "calibration/material_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include <opencv2/core.hpp>

#include "scene/core/parallel.h"

namespace daylit::calibration {

namespace {

constexpr std::size_t kFewest = 12; ///< samples that a material needs
constexpr int kMostSteps = 15;
constexpr double kSettled = 1e-4; ///< step of ln rho
constexpr double kProbe = 0.05;   ///< step of ln rho for derivatives
constexpr double kLargestStep = 0.7;
constexpr double kRenew = 0.05;                       ///< after larger steps the derivatives are measured anew
constexpr double kDarkest = 0.004, kBrightest = 0.97; ///< reflectances that the transport is asked for
constexpr double kTukey = 4.685;                      ///< 95 % efficient for a normal distribution
constexpr double kFlat = 0.5;                         ///< part of that where all pixels count alike
constexpr double kLeastScatter = 0.01;                ///< relative
constexpr double kModel = 0.008;                      ///< relative, standard deviation: mesh, rays, direct light
constexpr double kFewTiles = 0.02; ///< the same where too few parts of pictures show a material to tell
constexpr double kUnseen = 0.25;   ///< standard deviation of a reflectance that nobody measured
constexpr double kPi = std::numbers::pi;

double median(std::vector<double> values) {
  if (values.empty())
    return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// ln rho of every material and channel.
using LogRho = std::vector<std::array<double, 3>>;

class Fit {
public:
  Fit(const Room& room, const MaterialSamples& samples, const std::vector<MaterialView>& views,
      RoomTransport& transport)
      : room_(room), samples_(samples), views_(views), transport_(transport), of_material_(room.materials.size()) {
    for (std::size_t i = 0; i < samples.list.size(); ++i)
      of_material_[samples.list[i].material].push_back(i);
    ratio_.resize(samples.list.size());
    weight_.assign(samples.list.size(), 1.0);
    for (std::uint32_t m = 0; m < room.materials.size(); ++m) {
      const bool unknown = of_material_[m].size() >= kFewest;
      const Rgb& given = room.materials[m].reflectance;
      x_.push_back({start(given.r, unknown), start(given.g, unknown), start(given.b, unknown)});
      if (unknown)
        unknown_.push_back(m);
    }
  }

  Result<MaterialFit> run(const Progress& progress);

private:
  static double start(float given, bool unknown) {
    return std::log(std::clamp(static_cast<double>(given), unknown ? 0.05 : kDarkest, unknown ? 0.9 : kBrightest));
  }
  /// ln of the robust mean of pi L / E of each material, for reflectances exp(x).
  Result<LogRho> estimate(const LogRho& x);
  /// E of every sample, and from it the ratios.
  void measure(const radiosity::Radiosity& b);
  void weigh();
  LogRho means() const;
  /// K = d (estimate) / d ln rho of materials `of`, per channel: rows unknown_, columns `of`.
  Result<std::array<cv::Mat1d, 3>> derivatives(const LogRho& base, const std::vector<std::uint32_t>& of);
  Result<double> step();
  Result<void> add_uncertainty(MaterialFit& fit);
  /// Standard deviation of a material's mean, relative, from how parts of the pictures differ.
  double spread_of_tiles(std::uint32_t material, int channel) const;
  MaterialEstimate describe(std::uint32_t material) const;
  double slope(std::uint32_t material) const;
  std::vector<ViewAgreement> agreement() const;

  const Room& room_;
  const MaterialSamples& samples_;
  const std::vector<MaterialView>& views_;
  RoomTransport& transport_;
  std::vector<std::vector<std::size_t>> of_material_;
  std::vector<std::uint32_t> unknown_;
  std::vector<std::array<double, 3>> ratio_; ///< pi L / E of each sample
  std::vector<double> weight_;
  LogRho x_;
  std::array<cv::Mat1d, 3> derivative_;
  bool derivatives_wanted_ = true;
  radiosity::Radiosity radiosity_;
};

/// E = direct + mean of the radiosities that the rays meet.
void Fit::measure(const radiosity::Radiosity& b) {
  const std::size_t skies = transport_.skies();
  parallel_for(std::size_t{0}, samples_.list.size(), [&](std::size_t i) {
    const MaterialSample& s = samples_.list[i];
    std::array<double, 3> indirect{};
    for (std::size_t k = 0; k < MaterialSamples::kRays; ++k)
      if (const std::int32_t patch = samples_.patch[i * MaterialSamples::kRays + k]; patch >= 0)
        for (std::size_t c = 0; c < 3; ++c)
          indirect[c] += static_cast<double>(b.row(static_cast<std::size_t>(patch))[c * skies + views_[s.view].sky]);
    for (std::size_t c = 0; c < 3; ++c) {
      const auto channel = static_cast<glm::length_t>(c);
      const double e = static_cast<double>(s.direct[channel]) + indirect[c] / MaterialSamples::kRays;
      ratio_[i][c] = kPi * static_cast<double>(s.radiance[channel]) / std::max(e, 1e-30);
    }
  });
}

/// Around the median, in ln of the ratio: 1 in the middle, so that the two tones of a pattern count alike, then Tukey's
/// biweight down to 0; the smallest over the channels.
void Fit::weigh() {
  for (const std::uint32_t m : unknown_)
    for (std::size_t c = 0; c < 3; ++c) {
      std::vector<double> logs, deviation;
      for (const std::size_t i : of_material_[m])
        logs.push_back(std::log(ratio_[i][c]));
      const double middle = median(logs);
      for (const double l : logs)
        deviation.push_back(std::abs(l - middle));
      const double reach = kTukey * std::max(1.4826 * median(deviation), kLeastScatter);
      for (std::size_t k = 0; k < logs.size(); ++k) {
        const double u = std::max(std::abs(logs[k] - middle) / reach - kFlat, 0.0) / (1.0 - kFlat);
        const double w = u < 1.0 ? (1 - u * u) * (1 - u * u) : 0.0;
        double& weight = weight_[of_material_[m][k]];
        weight = c == 0 ? w : std::min(weight, w);
      }
    }
}

LogRho Fit::means() const {
  LogRho out = x_;
  for (const std::uint32_t m : unknown_)
    for (std::size_t c = 0; c < 3; ++c) {
      double sum = 0, weights = 1e-30;
      for (const std::size_t i : of_material_[m])
        sum += weight_[i] * ratio_[i][c], weights += weight_[i];
      out[m][c] = std::log(std::max(sum / weights, 1e-6));
    }
  return out;
}

Result<LogRho> Fit::estimate(const LogRho& x) {
  std::vector<Rgb> rho(x.size());
  for (std::size_t m = 0; m < x.size(); ++m)
    for (int c = 0; c < 3; ++c)
      rho[m][c] = static_cast<float>(std::clamp(std::exp(x[m][static_cast<std::size_t>(c)]), kDarkest, kBrightest));
  auto solved = transport_.solve(rho);
  if (!solved)
    return solved.error();
  measure(*solved);
  radiosity_ = std::move(*solved);
  return means();
}

Result<std::array<cv::Mat1d, 3>> Fit::derivatives(const LogRho& base, const std::vector<std::uint32_t>& of) {
  std::array<cv::Mat1d, 3> k;
  for (cv::Mat1d& m : k)
    m = cv::Mat1d::zeros(static_cast<int>(unknown_.size()), static_cast<int>(of.size()));
  for (std::size_t j = 0; j < of.size(); ++j) {
    LogRho moved = x_;
    for (double& v : moved[of[j]])
      v -= kProbe; // darker: never above the brightest
    const auto there = estimate(moved);
    if (!there)
      return there.error();
    for (std::size_t i = 0; i < unknown_.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c)
        k[c](static_cast<int>(i), static_cast<int>(j)) = (base[unknown_[i]][c] - (*there)[unknown_[i]][c]) / kProbe;
  }
  return k;
}

/// Newton on estimate(x) - x = 0: (1 - K) step = estimate(x) - x. Returns the largest part of the step.
Result<double> Fit::step() {
  auto now = estimate(x_);
  if (!now)
    return now.error();
  weigh();
  const LogRho target = means();
  if (derivatives_wanted_) {
    auto k = derivatives(target, unknown_);
    if (!k)
      return k.error();
    derivative_ = std::move(*k);
  }
  const auto n = static_cast<int>(unknown_.size());
  double largest = 0.0;
  for (std::size_t c = 0; c < 3; ++c) {
    cv::Mat1d residual(n, 1), move;
    for (int i = 0; i < n; ++i)
      residual(i) = target[unknown_[static_cast<std::size_t>(i)]][c] - x_[unknown_[static_cast<std::size_t>(i)]][c];
    const cv::Mat matrix = cv::Mat1d::eye(n, n) - derivative_[c];
    cv::solve(matrix, residual, move, cv::DECOMP_SVD);
    for (int i = 0; i < n; ++i) {
      const double d = std::clamp(move(i), -kLargestStep, kLargestStep);
      x_[unknown_[static_cast<std::size_t>(i)]][c] += d;
      largest = std::max(largest, std::abs(d));
    }
  }
  derivatives_wanted_ = largest > kRenew;
  return largest;
}

/// Tiles count as independent, the pixels in one do not. s^2 = sum w^2 (r - mean)^2 / (sum w)^2 x n / (n - 1).
double Fit::spread_of_tiles(std::uint32_t material, int channel) const {
  const auto c = static_cast<std::size_t>(channel);
  std::map<std::uint32_t, std::pair<double, double>> tiles;
  double weights = 0;
  for (const std::size_t i : of_material_[material]) {
    auto& [sum, w] = tiles[samples_.list[i].tile];
    sum += weight_[i] * ratio_[i][c], w += weight_[i];
    weights += weight_[i];
  }
  const double mean = std::exp(x_[material][c]);
  double square = 0, count = 0;
  for (const auto& [tile, part] : tiles) {
    const auto [sum, w] = part;
    if (!(w > 0))
      continue;
    const double off = sum / w / mean - 1.0;
    square += w * w * off * off;
    ++count;
  }
  const double s = count > 1 ? std::sqrt(square / (weights * weights) * count / (count - 1)) : 0.0;
  return std::hypot(s, count >= 4 ? kModel : kFewTiles);
}

/// d x = (1 - K)^-1 (d measured + K_unseen d x_unseen), independent parts.
Result<void> Fit::add_uncertainty(MaterialFit& fit) {
  std::vector<std::uint32_t> unseen;
  for (std::uint32_t m = 0; m < room_.materials.size(); ++m)
    if (!room_.materials[m].is_window && of_material_[m].size() < kFewest)
      unseen.push_back(m);
  const auto base = estimate(x_);
  if (!base)
    return base.error();
  const radiosity::Radiosity solution = radiosity_;
  const auto of_unseen = derivatives(*base, unseen);
  if (!of_unseen)
    return of_unseen.error();
  radiosity_ = solution;
  measure(radiosity_);
  const auto n = static_cast<int>(unknown_.size());
  for (int c = 0; c < 3; ++c) {
    const auto channel = static_cast<std::size_t>(c);
    cv::Mat1d inverse;
    cv::invert(cv::Mat(cv::Mat1d::eye(n, n) - derivative_[channel]), inverse, cv::DECOMP_SVD);
    cv::Mat1d through;
    if (!unseen.empty())
      cv::gemm(inverse, (*of_unseen)[channel], 1.0, cv::noArray(), 0.0, through);
    for (int i = 0; i < n; ++i) {
      double variance = 0;
      for (int j = 0; j < n; ++j)
        variance += std::pow(inverse(i, j) * spread_of_tiles(unknown_[static_cast<std::size_t>(j)], c), 2);
      for (std::size_t u = 0; u < unseen.size(); ++u)
        variance += std::pow(through(i, static_cast<int>(u)) * kUnseen / std::exp(x_[unseen[u]][channel]), 2);
      const std::uint32_t m = unknown_[static_cast<std::size_t>(i)];
      fit.materials[m].uncertainty[c] = static_cast<float>(2.0 * std::exp(x_[m][channel]) * std::sqrt(variance));
    }
  }
  return {};
}

/// Least squares line of ln L over ln E, of the pixels within a factor of four of what is expected. Wrong light gives
/// pixels that do not follow it.
double Fit::slope(std::uint32_t material) const {
  constexpr double kVaries = 0.15, kFactor = 4.0;
  double n = 0, se = 0, sl = 0, see = 0, sel = 0;
  for (const std::size_t i : of_material_[material]) {
    const double l = std::log(kPi * static_cast<double>(samples_.list[i].radiance.g));
    const double e = l - std::log(ratio_[i][1]);
    if (std::abs(l - e - x_[material][1]) > std::log(kFactor))
      continue;
    ++n, se += e, sl += l, see += e * e, sel += e * l;
  }
  const double variance = n > 2 ? see / n - se * se / (n * n) : 0.0;
  return variance > kVaries * kVaries ? (sel / n - se * sl / (n * n)) / variance : 0.0;
}

MaterialEstimate Fit::describe(std::uint32_t material) const {
  const Material& given = room_.materials[material];
  MaterialEstimate out;
  out.name = given.name;
  out.given = out.reflectance = given.reflectance;
  out.uncertainty = Rgb(static_cast<float>(2.0 * kUnseen));
  out.samples = of_material_[material].size();
  for (const auto& view : samples_.coverage)
    out.coverage = std::max(out.coverage, view[material]);
  out.seen = out.samples >= kFewest;
  if (!out.seen)
    return out;
  double agree = 0, square = 0, weights = 0;
  for (const std::size_t i : of_material_[material]) {
    agree += weight_[i] > 0 ? 1 : 0;
    square += weight_[i] * std::pow(ratio_[i][1] / std::exp(x_[material][1]) - 1.0, 2);
    weights += weight_[i];
  }
  out.used = agree / static_cast<double>(out.samples);
  out.scatter = std::sqrt(square / std::max(weights, 1e-30));
  for (int c = 0; c < 3; ++c)
    out.reflectance[c] = static_cast<float>(std::exp(x_[material][static_cast<std::size_t>(c)]));
  out.slope = slope(material);
  return out;
}

std::vector<ViewAgreement> Fit::agreement() const {
  std::vector<ViewAgreement> out(views_.size());
  for (std::uint32_t v = 0; v < views_.size(); ++v) {
    std::vector<double> level;
    double agree = 0;
    for (const std::uint32_t m : unknown_)
      for (const std::size_t i : of_material_[m])
        if (samples_.list[i].view == v) {
          level.push_back(ratio_[i][1] / std::exp(x_[m][1]));
          agree += weight_[i] > 0 ? 1 : 0;
        }
    if (!level.empty())
      out[v] = {agree / static_cast<double>(level.size()), median(level)};
  }
  return out;
}

Result<MaterialFit> Fit::run(const Progress& progress) {
  if (unknown_.empty())
    return Error{ErrorCode::not_found, "no picture shows a surface of the room", "materials",
                 "check the poses, the masks and the room model"};
  MaterialFit fit;
  while (fit.steps < kMostSteps && !fit.settled) {
    if (!progress("reflectances", static_cast<double>(fit.steps) / kMostSteps))
      return interrupted_error("reflectances");
    const auto moved = step();
    if (!moved)
      return moved.error();
    ++fit.steps;
    fit.settled = *moved < kSettled;
  }
  for (std::uint32_t m = 0; m < room_.materials.size(); ++m)
    fit.materials.push_back(describe(m));
  if (const Result<void> done = add_uncertainty(fit); !done)
    return done.error();
  for (std::uint32_t m = 0; m < room_.materials.size(); ++m)
    fit.reflectance.push_back(fit.materials[m].reflectance);
  fit.views = agreement();
  fit.radiosity = std::move(radiosity_);
  return fit;
}

} // namespace

Result<MaterialFit> fit_materials(const Room& room, const MaterialSamples& samples,
                                  const std::vector<MaterialView>& views, RoomTransport& transport,
                                  const Progress& progress) {
  return Fit(room, samples, views, transport).run(progress);
}

} // namespace daylit::calibration
