#include "calibration/vignette_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <opencv2/core.hpp>

namespace daylit::calibration {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int kTerms = 3;
constexpr int kRounds = 20;
constexpr double kLeast = 0.02; ///< sensitivity, while the coefficients are not yet right
constexpr double kRing = 2.0 * kDegree;
constexpr int kSectors = 16;
constexpr std::size_t kFewestSamples = 6;
constexpr double kInnermost = 20 * kDegree, kOutermost = 40 * kDegree;

double median(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return static_cast<double>(*middle);
}

/// Of pairs of opposite sectors about their mean.
double unevenness(const std::vector<double>& light) {
  const std::size_t half = light.size() / 2;
  const double mean = std::accumulate(light.begin(), light.end(), 0.0) / static_cast<double>(half);
  double square = 0;
  for (std::size_t k = 0; k < half; ++k)
    square += std::pow((light[k] + light[k + half]) / mean - 1.0, 2);
  return std::sqrt(square / static_cast<double>(half));
}

// Gauss-Newton for ln value = ln level + ln(1 + a1 t^2 + ...): relative errors count alike at all angles.
FallOff solve(const std::vector<FallOffSample>& samples, std::vector<double>& level) {
  const int sources = static_cast<int>(level.size()), unknowns = sources + kTerms;
  FallOff fall_off{std::vector<double>(kTerms, 0.0)};
  for (const FallOffSample& s : samples)
    level[s.source] = std::max(level[s.source], s.value);
  for (int round = 0; round < kRounds; ++round) {
    cv::Mat normal = cv::Mat::zeros(unknowns, unknowns, CV_64F), right = cv::Mat::zeros(unknowns, 1, CV_64F), step;
    for (const FallOffSample& s : samples) {
      const double v = std::max(fall_off.at(s.theta), kLeast), t = s.theta * s.theta;
      const std::pair<int, double> slope[] = {
          {static_cast<int>(s.source), 1.0}, {sources, t / v}, {sources + 1, t * t / v}, {sources + 2, t * t * t / v}};
      const double off = std::log(s.value / (level[s.source] * v));
      for (const auto& [i, di] : slope) {
        for (const auto& [j, dj] : slope)
          normal.at<double>(i, j) += di * dj;
        right.at<double>(i) += di * off;
      }
    }
    cv::solve(normal, right, step, cv::DECOMP_SVD);
    for (int k = 0; k < sources; ++k)
      level[static_cast<std::size_t>(k)] *= std::exp(std::clamp(step.at<double>(k), -1.0, 1.0));
    for (int i = 0; i < kTerms; ++i)
      fall_off.coefficient[static_cast<std::size_t>(i)] += step.at<double>(sources + i);
  }
  return fall_off;
}

double rms_of(const std::vector<FallOffSample>& samples, const FallOff& fall_off, const std::vector<double>& level) {
  double sum = 0;
  for (const FallOffSample& s : samples)
    sum += std::pow(s.value / (level[s.source] * fall_off.at(s.theta)) - 1.0, 2);
  return std::sqrt(sum / static_cast<double>(samples.size()));
}

} // namespace

std::vector<FallOffSample> ring_samples(const RgbImage& picture, const LensModel& lens, std::size_t source) {
  const auto rings = static_cast<std::size_t>(lens.max_theta / kRing);
  std::vector<std::vector<float>> values(rings * kSectors);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const auto d = lens.unproject({x, y});
      if (!d)
        continue;
      const auto ring = static_cast<std::size_t>(std::acos(std::clamp(d->z, -1.0, 1.0)) / kRing);
      const double turn = std::atan2(d->y, d->x) / (2 * std::numbers::pi) + 0.5;
      const auto sector = std::min(static_cast<std::size_t>(turn * kSectors), std::size_t{kSectors - 1});
      if (ring < rings)
        values[ring * kSectors + sector].push_back(luminance(picture.at(x, y)));
    }
  std::vector<FallOffSample> samples;
  for (std::size_t ring = 0; ring < rings; ++ring) {
    double sum = 0;
    std::vector<double> light;
    for (std::size_t k = 0; k < kSectors; ++k)
      if (auto& sector = values[ring * kSectors + k]; !sector.empty()) {
        light.push_back(median(sector));
        sum += light.back();
      }
    if (light.size() == kSectors && sum > 0)
      samples.push_back({(static_cast<double>(ring) + 0.5) * kRing, sum / kSectors, source, unevenness(light)});
  }
  return samples;
}

Result<FallOffFit> fit_fall_off(const std::vector<FallOffSample>& samples) {
  FallOffFit fit;
  double innermost = 10;
  std::size_t sources = 0;
  for (const FallOffSample& s : samples) {
    fit.reach = std::max(fit.reach, s.theta);
    fit.uneven = std::max(fit.uneven, s.uneven);
    innermost = std::min(innermost, s.theta);
    sources = std::max(sources, s.source + 1);
  }
  if (samples.size() < kFewestSamples || innermost > kInnermost || fit.reach < kOutermost)
    return Error{ErrorCode::value_invalid, "samples that do not reach from the axis to 40 degrees", "vignette",
                 "see the evenly lit surface in the whole picture, or the lamp in its middle and towards its edge"};
  std::vector<double> level(sources), other_level(sources);
  fit.fall_off = solve(samples, level);
  fit.rms = rms_of(samples, fit.fall_off, level);
  std::vector<FallOffSample> half[2];
  for (std::size_t i = 0; i < samples.size(); ++i)
    half[i % 2].push_back(samples[i]);
  const FallOff other = solve(half[0], other_level);
  fit.held_out = rms_of(half[1], other, other_level);
  fit.at_reach = fit.fall_off.at(fit.reach);
  for (const FallOffSample& s : samples) {
    fit.theta.push_back(s.theta);
    fit.relative.push_back(s.value / level[s.source]);
  }
  return fit;
}

} // namespace daylit::calibration
