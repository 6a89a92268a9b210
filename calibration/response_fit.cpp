#include "calibration/response_fit.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <opencv2/core.hpp>

namespace daylit::calibration {

namespace {

constexpr std::size_t kCodes = 256;
constexpr std::size_t kMiddle = 128; ///< the code whose exposure is 1 while the curve is fitted
constexpr double kSmooth = 3000.0;   ///< weight of the second difference, per mean number of samples of a code
constexpr double kLeastSmooth = 1e-3;
constexpr double kWidth = 4.0; ///< of Robertson's Gaussian weight
constexpr int kRounds = 60;
constexpr std::size_t kReach = 6; ///< codes on both sides over which the curve is smoothed in the end
constexpr std::size_t kFewestSamples = 500;
constexpr double kTelling = 0.02;        ///< weight per place from which a picture's own exposure is known
constexpr double kDoubled = 1.9;         ///< ratio of exposure times
constexpr float kHardlyRises = 3.0f;     ///< codes of 255
constexpr std::size_t kFewestDead = 100; ///< places

/// A code of one place in one picture.
struct Sample {
  double at = 0.0; ///< 0..255
  double log_time = 0.0, weight = 0.0;
  std::size_t picture = 0;
  std::size_t low() const { return std::min(static_cast<std::size_t>(at), kCodes - 2); }
  double part() const { return at - static_cast<double>(low()); }
};
using Place = std::vector<Sample>;
using LogCurve = std::array<double, kCodes>; ///< ln exposure by code

double value(const LogCurve& g, const Sample& s) { return (1 - s.part()) * g[s.low()] + s.part() * g[s.low() + 1]; }

/// Hat (Debevec & Malik eq. 4), 0..1, from black to white.
double hat(double code, double black = 0.0) {
  return std::max(0.0, std::min(code - black, 255.0 - code) / (0.5 * (255.0 - black)));
}

/// The highest code that says nothing but "dark": of places whose code hardly rises although the exposure doubles, as
/// fog of film, or a pedestal, makes them.
double black_code(std::span<const PlaceCodes> pictures, int channel) {
  std::vector<double> dead;
  for (std::size_t p = 0; p < pictures.size(); ++p)
    for (std::size_t q = p + 1; q < pictures.size(); ++q) {
      if (pictures[q].time < kDoubled * pictures[p].time)
        continue;
      for (std::size_t i = 0; i < pictures[p].code.size(); ++i) {
        const float a = pictures[p].code[i][channel], b = pictures[q].code[i][channel];
        if (a >= 0.0f && a < 0.5f && b >= 0.0f && 255.0f * (b - a) < kHardlyRises)
          dead.push_back(255.0 * static_cast<double>(a));
      }
      break;
    }
  if (dead.size() < kFewestDead)
    return 0.0;
  const auto median = [](std::vector<double>& v) {
    std::ranges::nth_element(v, v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2));
    return v[v.size() / 2];
  };
  const double middle = median(dead);
  for (double& d : dead)
    d = std::abs(d - middle);
  return std::ceil(middle + 2.0 * median(dead));
}

std::vector<Place> places_of(std::span<const PlaceCodes> pictures, int channel, double black) {
  std::vector<Place> places;
  for (std::size_t i = 0; i < pictures.front().code.size(); ++i) {
    Place place;
    for (std::size_t p = 0; p < pictures.size(); ++p) {
      const double at = 255.0 * static_cast<double>(pictures[p].code[i][channel]);
      if (at > black + 0.5 && at < 254.5)
        place.push_back({at, std::log(pictures[p].time), std::pow(hat(at, black), 2), p});
    }
    if (place.size() >= 2)
      places.push_back(std::move(place));
  }
  return places;
}

/// Weighted mean of ln radiance.
double log_radiance(const Place& place, const LogCurve& g) {
  double sum = 0, weight = 0;
  for (const Sample& s : place) {
    sum += s.weight * (value(g, s) - s.log_time);
    weight += s.weight;
  }
  return sum / weight;
}

// Debevec & Malik 1997, eq. 3: minimises sum w (g(z_ij) - ln E_i - ln t_j)^2 + smoothness; the ln E_i are eliminated
// (Schur complement), so that 256 unknowns are left however many places there are. The second difference counts less
// towards black, where the logarithm of a response bends most.
bool debevec(const std::vector<Place>& places, double black, LogCurve& g) {
  cv::Mat normal = cv::Mat::zeros(kCodes, kCodes, CV_64F), right = cv::Mat::zeros(kCodes, 1, CV_64F), solution;
  double samples = 0;
  for (const Place& place : places) {
    std::vector<std::pair<int, double>> sum; // sum over the place of w b, b = the two codes around z
    double weight = 0, sum_time = 0;
    for (const Sample& s : place) {
      const int k = static_cast<int>(s.low());
      const double b[2] = {1 - s.part(), s.part()};
      for (int r = 0; r < 2; ++r) {
        for (int c = 0; c < 2; ++c)
          normal.at<double>(k + r, k + c) += s.weight * b[r] * b[c];
        right.at<double>(k + r) += s.weight * b[r] * s.log_time;
        sum.emplace_back(k + r, s.weight * b[r]);
      }
      weight += s.weight;
      sum_time += s.weight * s.log_time;
    }
    for (const auto& [r, wr] : sum) {
      for (const auto& [c, wc] : sum)
        normal.at<double>(r, c) -= wr * wc / weight;
      right.at<double>(r) -= wr * sum_time / weight;
    }
    samples += weight;
  }
  const double mean = samples / kCodes;
  for (int k = 1; k < static_cast<int>(kCodes) - 1; ++k) {
    const double lit = std::clamp((k - black) / (kMiddle - black), 0.0, 1.0);
    const double w = mean * std::max(kSmooth * std::pow(lit, 4), kLeastSmooth);
    const double second[3] = {1, -2, 1};
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        normal.at<double>(k - 1 + r, k - 1 + c) += w * second[r] * second[c];
  }
  normal.at<double>(kMiddle, kMiddle) += samples;
  if (!cv::solve(normal, right, solution, cv::DECOMP_CHOLESKY))
    return false;
  for (std::size_t k = 0; k < kCodes; ++k)
    g[k] = solution.at<double>(static_cast<int>(k)) - solution.at<double>(kMiddle);
  return true;
}

/// Straight lines between the codes that have a value.
void fill_gaps(LogCurve& g, const std::array<double, kCodes>& weight) {
  std::size_t last = kCodes;
  for (std::size_t k = 0; k < kCodes; ++k) {
    if (weight[k] <= 0)
      continue;
    for (std::size_t m = last == kCodes ? 0 : last + 1; m < k; ++m)
      g[m] = last == kCodes
                 ? g[k] + std::log((static_cast<double>(m) + 0.5) / (static_cast<double>(k) + 0.5))
                 : g[last] + (g[k] - g[last]) * static_cast<double>(m - last) / static_cast<double>(k - last);
    last = k;
  }
  for (std::size_t m = last + 1; m < kCodes; ++m)
    g[m] = g[last] + std::log(static_cast<double>(m) / static_cast<double>(last));
}

/// Local straight lines through the codes around, weighted by their samples.
void smooth(LogCurve& g, const std::array<double, kCodes>& count) {
  const LogCurve raw = g;
  for (std::size_t k = kReach; k + kReach < kCodes; ++k) {
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (std::size_t m = k - kReach; m <= k + kReach; ++m) {
      const double d = static_cast<double>(m) - static_cast<double>(k);
      n += count[m];
      x += count[m] * d;
      y += count[m] * raw[m];
      xx += count[m] * d * d;
      xy += count[m] * d * raw[m];
    }
    const double determinant = n * xx - x * x;
    if (determinant > 0)
      g[k] = (y * xx - x * xy) / determinant;
  }
}

// Robertson et al. 2003, eqs. 8 and 10: radiances from the curve, x = sum w t I / sum w t^2, then the curve from the
// radiances, I(m) = mean of t x over the samples of code m; each round scaled to I(128) = 1.
// Begins at the curve of Debevec and Malik: from a straight line it takes hundreds of rounds.
bool robertson(const std::vector<Place>& places, double black, LogCurve& g) {
  if (!debevec(places, black, g))
    return false;
  for (int round = 0; round < kRounds; ++round) {
    std::array<double, kCodes> sum{}, count{};
    for (const Place& place : places) {
      double above = 0, below = 0;
      for (const Sample& s : place) {
        const double t = std::exp(s.log_time), w = std::exp(-kWidth * std::pow(s.at / 127.5 - 1.0, 2));
        above += w * t * std::exp(value(g, s));
        below += w * t * t;
      }
      for (const Sample& s : place) {
        const auto k = static_cast<std::size_t>(std::lround(s.at));
        // The curve at the sample's own place, moved to the whole code along the present curve.
        sum[k] += std::exp(s.log_time + g[k] - value(g, s)) * above / below;
        count[k] += 1;
      }
    }
    for (std::size_t k = 0; k < kCodes; ++k)
      if (count[k] > 0)
        g[k] = std::log(sum[k] / count[k]);
    fill_gaps(g, count);
    const double middle = g[kMiddle];
    for (double& v : g)
      v -= middle;
    if (round == kRounds - 1)
      smooth(g, count);
  }
  return true;
}

/// Pool-adjacent-violators (Ayer et al. 1955): the nearest curve that never falls. Returns the largest relative fall
/// between 5 and 95 % of the range from black to white.
double make_monotone(LogCurve& g, double black) {
  const auto from = static_cast<std::size_t>(black + 0.05 * (255 - black)), to = static_cast<std::size_t>(242);
  double highest = g[from], fall = 0;
  for (std::size_t k = from; k <= to; ++k) {
    highest = std::max(highest, g[k]);
    fall = std::max(fall, highest - g[k]);
  }
  struct Block {
    double mean;
    std::size_t size;
  };
  std::vector<Block> blocks;
  for (const double v : g) {
    blocks.push_back({v, 1});
    while (blocks.size() > 1 && blocks[blocks.size() - 2].mean > blocks.back().mean) {
      const Block last = blocks.back();
      blocks.pop_back();
      Block& b = blocks.back();
      b.mean = (b.mean * static_cast<double>(b.size) + last.mean * static_cast<double>(last.size)) /
               static_cast<double>(b.size + last.size);
      b.size += last.size;
    }
  }
  std::size_t k = 0;
  for (const Block& b : blocks)
    for (std::size_t i = 0; i < b.size; ++i)
      g[k++] = b.mean;
  return 1.0 - std::exp(-fall);
}

/// Weighted rms of the relative residuals.
double residual_of(const std::vector<Place>& places, const LogCurve& g) {
  double square = 0, all = 0;
  for (const Place& place : places) {
    const double e = log_radiance(place, g);
    for (const Sample& s : place) {
      const double r = value(g, s) - s.log_time - e;
      square += s.weight * r * r;
      all += s.weight;
    }
  }
  return std::sqrt(square / all);
}

/// Rms relative distance of the curve from the straight line through zero that is nearest, between 5 and 95 %.
double distance_from_line(const LogCurve& g) {
  constexpr std::size_t kFrom = 13, kTo = 242;
  double mean = 0, square = 0;
  for (std::size_t k = kFrom; k <= kTo; ++k)
    mean += (g[k] - std::log(static_cast<double>(k))) / (kTo - kFrom + 1);
  for (std::size_t k = kFrom; k <= kTo; ++k)
    square += std::pow(g[k] - std::log(static_cast<double>(k)) - mean, 2) / (kTo - kFrom + 1);
  return std::sqrt(square);
}

bool fit_curve(const std::vector<Place>& places, ResponseMethod method, double black, LogCurve& g) {
  return method == ResponseMethod::debevec ? debevec(places, black, g) : robertson(places, black, g);
}

/// Every second place.
std::vector<Place> half_of(const std::vector<Place>& places, std::size_t first) {
  std::vector<Place> half;
  for (std::size_t i = first; i < places.size(); i += 2)
    half.push_back(places[i]);
  return half;
}

std::pair<int, int> range_of(const std::vector<Place>& places) {
  double low = 255, high = 0;
  for (const Place& place : places)
    for (const Sample& s : place) {
      low = std::min(low, s.at);
      high = std::max(high, s.at);
    }
  return {static_cast<int>(std::ceil(low)), static_cast<int>(std::floor(high))};
}

/// The curve of one channel, or of all together; nothing where places are too few.
bool fit_channel(const std::vector<Place>& places, ResponseMethod method, double black, ResponseFit& fit, LogCurve& g) {
  const std::size_t samples = std::accumulate(places.begin(), places.end(), std::size_t{0},
                                              [](std::size_t n, const Place& p) { return n + p.size(); });
  LogCurve half{};
  if (samples < kFewestSamples || !fit_curve(places, method, black, g) ||
      !fit_curve(half_of(places, 0), method, black, half))
    return false;
  const auto [low, high] = range_of(places);
  fit.lowest_code = std::max(fit.lowest_code, low);
  fit.highest_code = std::min(fit.highest_code, high);
  fit.fall = std::max(fit.fall, make_monotone(g, black));
  make_monotone(half, black);
  fit.residual = std::max(fit.residual, residual_of(places, g));
  fit.held_out = std::max(fit.held_out, residual_of(half_of(places, 1), half));
  fit.linear_deviation = std::max(fit.linear_deviation, distance_from_line(g));
  return true;
}

/// Measured exposure of a picture over the stated one, green channel: the curve and the radiances are those of the
/// other pictures. 0: not known.
double stated_ratio(std::span<const PlaceCodes> pictures, std::size_t p) {
  const double black = black_code(pictures, 1);
  std::vector<Place> others;
  Place own;
  for (Place& place : places_of(pictures, 1, black)) {
    const auto mine = std::ranges::find(place, p, &Sample::picture);
    const bool has = mine != place.end();
    const Sample sample = has ? *mine : Sample{};
    if (has)
      place.erase(mine);
    if (has ? place.size() >= 1 : place.size() >= 2) {
      others.push_back(std::move(place));
      own.push_back(sample);
    }
  }
  LogCurve g{};
  double sum = 0, weight = 0;
  if (others.size() < kFewestSamples / 2 || !debevec(others, black, g))
    return 0.0;
  for (std::size_t i = 0; i < others.size(); ++i) {
    sum += own[i].weight * (value(g, own[i]) - own[i].log_time - log_radiance(others[i], g));
    weight += own[i].weight;
  }
  return weight > kTelling * static_cast<double>(others.size()) ? std::exp(sum / weight) : 0.0;
}

} // namespace

Result<ResponseFit> fit_response(std::span<const PlaceCodes> pictures, ResponseMethod method, bool channels_alike) {
  ResponseFit fit;
  ResponseCurve::Table table;
  for (int c = 0; c < 3; c += channels_alike ? 3 : 1) {
    const double black = black_code(pictures, c);
    std::vector<Place> places;
    for (int from = c; from < (channels_alike ? 3 : c + 1); ++from)
      std::ranges::move(places_of(pictures, from, black), std::back_inserter(places));
    LogCurve g{};
    if (!fit_channel(places, method, black, fit, g))
      return Error{ErrorCode::value_invalid, "hardly any place is well exposed in two pictures", "response",
                   "take exposures that are one or two stops apart, of something with many tones"};
    for (int to = c; to < (channels_alike ? 3 : c + 1); ++to)
      for (std::size_t k = 0; k < kCodes; ++k)
        table[static_cast<std::size_t>(to)][k] =
            static_cast<double>(k) <= black ? 0.0f : static_cast<float>(std::exp(g[k] - g[kCodes - 1]));
  }
  for (std::size_t p = 0; p < pictures.size(); ++p)
    fit.stated_ratio.push_back(stated_ratio(pictures, p));
  const auto curve = ResponseCurve::from_table(table, "response");
  if (!curve)
    return curve.error();
  fit.curve = *curve;
  return fit;
}

} // namespace daylit::calibration
